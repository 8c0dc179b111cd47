//! Parsers of option values. An error names the values that the option accepts.

use std::fs;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use actq::emit::Core;
use actq::error::ensure;
use actq::import::contract::StatedLimits;
use actq::methods::{Effort, MAX_MINUTES};
use actq::numbers::decimal;
use actq::units;
use actq_controller::Limits;
use actq_kernels::Width;
use actq_kernels::layout::is_group;

pub(super) fn width(text: &str) -> Result<Width, String> {
    let known = text.parse().ok().and_then(Width::from_bits);
    known.ok_or_else(|| "use 2, 3, 4 or 8 bits".to_owned())
}

pub(super) fn core(text: &str) -> Result<Core, String> {
    let names = Core::ALL.map(|(name, _)| name).join(", ");
    Core::of_name(text).ok_or_else(|| format!("use one of {names}"))
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

/// Limits of `--limits`: one for all actions, or one for each.
#[derive(Clone, Debug)]
pub(crate) struct LimitList(Vec<Limits>);

impl LimitList {
    /// Returns them for actions of a rate.
    ///
    /// # Errors
    ///
    /// If they have a largest change in a second, and the rate is not known.
    pub(crate) fn at(&self, rate_hz: Option<f64>) -> actq::error::Result<StatedLimits> {
        let of = |value: fn(&Limits) -> f32| self.0.iter().map(value).map(decimal).collect();
        let has_rate = self.0.iter().any(|limits| limits.rate.is_some());
        ensure!(!has_rate || rate_hz.is_some(), "--limits has a largest change in a second; pass --rate-hz HZ, too");
        let step = |limits: &Limits| match (limits.rate, rate_hz) {
            (Some(rate), Some(rate_hz)) => decimal(rate) / rate_hz,
            _ => f64::INFINITY,
        };
        let max_step = if has_rate { self.0.iter().map(step).collect() } else { Vec::new() };
        Ok(StatedLimits { low: of(|limits| limits.low), high: of(|limits| limits.high), max_step })
    }
}

/// Parses limits for all actions, or reads a file with a line for each, and comments after `#`.
pub(super) fn limits(text: &str) -> Result<LimitList, String> {
    let error = match text.parse() {
        Ok(limits) => return Ok(LimitList(vec![limits])),
        Err(error) => error,
    };
    if !Path::new(text).is_file() {
        return Err(format!("no file has this name, and {error}"));
    }
    let lines = fs::read_to_string(text).map_err(|error| error.to_string())?;
    let line = |(i, line): (usize, &str)| {
        let limits = line.split('#').next().unwrap_or_default().trim();
        // A line without anything could stand for an action that was forgotten.
        let is_comment = limits.is_empty() && !line.trim().is_empty();
        (!is_comment).then(|| limits.parse().map_err(|error| format!("line {}: {line:?}: {error}", i + 1)))
    };
    // Editors of Windows begin a file with a mark of its encoding.
    let lines = lines.trim_start_matches('\u{feff}').trim_end().lines();
    let all: Vec<Limits> = lines.enumerate().filter_map(line).collect::<Result<_, _>>()?;
    if all.is_empty() {
        Err("the file is empty; it takes a line LOW:HIGH for each action".to_owned())
    } else {
        Ok(LimitList(all))
    }
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
