//! What options take: each is read, or refused in words that say what it takes.

use std::path::PathBuf;

use actq_kernels::Width;
use actq_kernels::layout::is_group;

pub(super) fn width(text: &str) -> Result<Width, String> {
    let known = text.parse().ok().and_then(Width::from_bits);
    known.ok_or_else(|| "weights have 2, 3, 4 or 8 bits".to_owned())
}

pub(super) fn pair(text: &str) -> Result<(String, String), String> {
    let (from, to) = text.split_once('=').ok_or_else(|| "the form is INPUT=OUTPUT".to_owned())?;
    Ok((from.to_owned(), to.to_owned()))
}

pub(super) fn rounds(text: &str) -> Result<usize, String> {
    let known = text.parse().ok().filter(|n| (1..=100).contains(n));
    known.ok_or_else(|| "1 to 100 rounds can be learned".to_owned())
}

pub(super) fn npz(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let is_npz = path.extension().is_some_and(|ending| ending == "npz");
    is_npz.then_some(path).ok_or_else(|| "a recording is written as .npz, and its name ends so".to_owned())
}

pub(super) fn forced(text: &str) -> Result<(String, Width), String> {
    let (name, bits) = text.split_once('=').ok_or_else(|| "the form is NAME=BITS".to_owned())?;
    Ok((name.to_owned(), width(bits)?))
}

pub(super) fn size(text: &str) -> Result<usize, String> {
    let (digits, unit) = match text.char_indices().next_back() {
        Some((at, 'M' | 'm')) => (&text[..at], 1024 * 1024),
        Some((at, 'K' | 'k')) => (&text[..at], 1024),
        _ => (text, 1),
    };
    let bytes = digits.parse().ok().and_then(|n: usize| n.checked_mul(unit)).filter(|n| *n > 0);
    bytes.ok_or_else(|| "a size is a number of bytes, or of KiB with a K behind it, or of MiB with an M".to_owned())
}

pub(super) fn group(text: &str) -> Result<usize, String> {
    let known = text.parse().ok().filter(|group| is_group(*group));
    known.ok_or_else(|| "groups have 32, 64 or 128 columns, or 0 for none".to_owned())
}

pub(super) fn positive(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|x: &f64| x.is_finite() && *x > 0.0);
    number.ok_or_else(|| "a number above 0 is needed".to_owned())
}

pub(super) fn minutes(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|x: &f64| *x > 0.0 && *x <= 10_080.0);
    number.ok_or_else(|| "a number above 0 is needed, and at most a week's 10080".to_owned())
}

/// Reads a clock in Hz, as `168M`, `84000K` or `168000000`.
pub(super) fn clock(text: &str) -> Result<f64, String> {
    let (digits, unit) = match text.char_indices().next_back() {
        Some((at, 'M' | 'm')) => (&text[..at], 1e6),
        Some((at, 'K' | 'k')) => (&text[..at], 1e3),
        _ => (text, 1.0),
    };
    let hertz = digits.parse().ok().map(|n: f64| n * unit).filter(|n| n.is_finite() && *n >= 1.0);
    hertz.ok_or_else(|| "a clock is a number of Hz, or of MHz with an M behind it".to_owned())
}
