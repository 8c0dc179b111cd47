//! Parsers of option values. An error names the values that the option accepts.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use actq::methods::{Effort, MAX_MINUTES};
use actq::units;
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

/// Parses a command line for a shell.
pub(super) fn command(text: &str) -> Result<String, String> {
    let is_empty = text.trim().is_empty();
    (!is_empty).then(|| text.to_owned()).ok_or_else(|| "name the command to run".to_owned())
}

pub(super) fn steps(text: &str) -> Result<NonZeroUsize, String> {
    text.parse().map_err(|_| "use 1 step or more".to_owned())
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
    units::bytes(text).map_err(|error| error.to_string())
}

pub(super) fn group(text: &str) -> Result<usize, String> {
    let known = text.parse().ok().filter(|group| is_group(*group));
    known.ok_or_else(|| "use 32, 64 or 128 columns, or 0 for no groups".to_owned())
}

pub(super) fn positive(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|x: &f64| x.is_finite() && *x > 0.0);
    number.ok_or_else(|| "use a number above 0".to_owned())
}

/// Reads a number of threads.
pub(super) fn threads(text: &str) -> Result<u16, String> {
    let number = text.parse().ok().filter(|threads| *threads <= 256);
    number.ok_or_else(|| "use a number from 0 (the default) to 256".to_owned())
}

/// Reads a seed.
pub(super) fn seed(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| "use a whole number, 0 or more".to_owned())
}

pub(super) fn finite(text: &str) -> Result<f32, String> {
    let number = text.parse().ok().filter(|x: &f32| x.is_finite());
    number.ok_or_else(|| "use a finite number".to_owned())
}

/// Reads an effort by its name.
pub(super) fn effort(text: &str) -> Result<Effort, String> {
    Effort::of_name(text).ok_or_else(|| "use quick, default or thorough".to_owned())
}

pub(super) fn minutes(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|x: &f64| *x > 0.0 && *x <= MAX_MINUTES);
    number.ok_or_else(|| format!("use a number above 0 and at most {MAX_MINUTES}, a week"))
}

pub(super) fn clock(text: &str) -> Result<f64, String> {
    units::hertz(text).map_err(|error| error.to_string())
}
