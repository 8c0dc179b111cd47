//! Parsers of option values. An error names the values that the option accepts.

use std::path::PathBuf;

use actq::methods::Effort;
use actq_kernels::Width;
use actq_kernels::layout::is_group;

pub(super) fn width(text: &str) -> Result<Width, String> {
    let known = text.parse().ok().and_then(Width::from_bits);
    known.ok_or_else(|| "use 2, 3, 4 or 8 bits".to_owned())
}

pub(super) fn pair(text: &str) -> Result<(String, String), String> {
    let (from, to) = text.split_once('=').ok_or_else(|| "use the form INPUT=OUTPUT".to_owned())?;
    Ok((from.to_owned(), to.to_owned()))
}

/// Parses two files with a colon between them.
pub(super) fn two_files(text: &str) -> Result<(PathBuf, PathBuf), String> {
    let both = text.rsplit_once(':').filter(|(first, second)| !first.is_empty() && !second.is_empty());
    let (first, second) = both.ok_or_else(|| "use the form RAW.npz:EXPECT.npz".to_owned())?;
    Ok((first.into(), second.into()))
}

pub(super) fn rounds(text: &str) -> Result<usize, String> {
    let known = text.parse().ok().filter(|n| (1..=100).contains(n));
    known.ok_or_else(|| "use 1 to 100 rounds".to_owned())
}

pub(super) fn npz(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let is_npz = path.extension().is_some_and(|ending| ending == "npz");
    is_npz.then_some(path).ok_or_else(|| "unknown recording format; use a name that ends in .npz".to_owned())
}

pub(super) fn forced(text: &str) -> Result<(String, Width), String> {
    let (name, bits) = text.split_once('=').ok_or_else(|| "use the form NAME=BITS".to_owned())?;
    Ok((name.to_owned(), width(bits)?))
}

pub(super) fn size(text: &str) -> Result<usize, String> {
    let (digits, unit) = match text.char_indices().next_back() {
        Some((at, 'M' | 'm')) => (&text[..at], 1024 * 1024),
        Some((at, 'K' | 'k')) => (&text[..at], 1024),
        _ => (text, 1),
    };
    let bytes = digits.parse().ok().and_then(|n: usize| n.checked_mul(unit)).filter(|n| *n > 0);
    bytes.ok_or_else(|| "use a number of bytes, or of KiB followed by K, or of MiB followed by M".to_owned())
}

pub(super) fn group(text: &str) -> Result<usize, String> {
    let known = text.parse().ok().filter(|group| is_group(*group));
    known.ok_or_else(|| "use 32, 64 or 128 columns, or 0 for no groups".to_owned())
}

pub(super) fn positive(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|x: &f64| x.is_finite() && *x > 0.0);
    number.ok_or_else(|| "use a number above 0".to_owned())
}

/// Reads an effort by its name.
pub(super) fn effort(text: &str) -> Result<Effort, String> {
    let found = Effort::ALL.into_iter().find(|(name, _)| *name == text);
    found.map(|(_, effort)| effort).ok_or_else(|| "use quick, default or thorough".to_owned())
}

pub(super) fn minutes(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|x: &f64| *x > 0.0 && *x <= 10_080.0);
    number.ok_or_else(|| "use a number above 0 and at most 10080, a week".to_owned())
}

/// Parses a clock in Hz, as `168M`, `84000K` or `168000000`.
pub(super) fn clock(text: &str) -> Result<f64, String> {
    let (digits, unit) = match text.char_indices().next_back() {
        Some((at, 'M' | 'm')) => (&text[..at], 1e6),
        Some((at, 'K' | 'k')) => (&text[..at], 1e3),
        _ => (text, 1.0),
    };
    let hertz = digits.parse().ok().map(|n: f64| n * unit).filter(|n| n.is_finite() && *n >= 1.0);
    hertz.ok_or_else(|| "use a number of Hz, or of MHz followed by M".to_owned())
}
