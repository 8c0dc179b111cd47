//! The guard before the head: it passes only observations that are complete, finite, in range and recent.

use core::fmt;

use actq_link::Floats;
use actq_link::code::Refusal;

use crate::age::Age;

/// The range of one value of an observation, ends included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Lowest value.
    pub low: f32,
    /// Highest value.
    pub high: f32,
}

/// Reason for refusing an observation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refused {
    /// The number of values differs from the image's input length.
    Length {
        /// Number of values that the image takes.
        expected: usize,
        /// Number of values received.
        given: usize,
    },
    /// A value is NaN or infinite.
    NotFinite {
        /// Index of the value.
        index: usize,
    },
    /// A value is outside its range.
    OutOfRange {
        /// Index of the value.
        index: usize,
    },
    /// The observation is too old.
    Old {
        /// Age in µs.
        age: u32,
    },
    /// The sender's time has jumped forward since the controller was armed.
    Ahead,
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Length { expected, given } => write!(f, "{given} values; the image takes {expected}"),
            Self::NotFinite { index } => write!(f, "value {index} is not finite"),
            Self::OutOfRange { index } => write!(f, "value {index} is outside its range"),
            Self::Old { age } => write!(f, "{age} µs older than the fastest delivery"),
            Self::Ahead => f.write_str("the sender's time has jumped forward"),
        }
    }
}

impl core::error::Error for Refused {}

/// Guard that keeps the newest accepted observation until the head takes it. `OBS` is the capacity for values.
#[derive(Debug)]
pub struct Guard<'r, const OBS: usize> {
    ranges: &'r [Range],
    /// Largest accepted age in µs.
    max_age: u32,
    /// Largest `max_age` that the build allows, in µs.
    built_max_age: u32,
    age: Age,
    /// `true` while the sender's time must not jump forward.
    is_bounded: bool,
    values: [f32; OBS],
    len: usize,
    /// Sequence number of the kept observation's frame.
    newest: Option<u32>,
    refused: u32,
}

impl<'r, const OBS: usize> Guard<'r, OBS> {
    /// Creates a guard for observations of `len` values, each in its range. With empty `ranges`, values only have to be
    /// finite; else a value without a range is refused.
    ///
    /// Returns `None` if `len` exceeds `OBS`.
    pub fn new(len: usize, ranges: &'r [Range], max_age: u32) -> Option<Self> {
        (len <= OBS).then(|| Self { len, ..Self::full(ranges, max_age) })
    }

    /// Creates a guard as [`Self::new`] does, for observations of `OBS` values.
    pub fn full(ranges: &'r [Range], max_age: u32) -> Self {
        Self {
            ranges,
            max_age,
            built_max_age: max_age,
            age: Age::default(),
            is_bounded: false,
            values: [0.0; OBS],
            len: OBS,
            newest: None,
            refused: 0,
        }
    }

    /// Checks an observation that was sent at `remote` µs and received at `local` µs, and keeps it if it is valid. A
    /// refused one is counted, and the last one stays.
    ///
    /// # Errors
    ///
    /// Returns the reason for a refusal.
    pub fn take(&mut self, of: u32, values: Floats<'_>, remote: u32, local: u32) -> Result<(), Refused> {
        self.check(values, remote, local).inspect_err(|_| self.refused = self.refused.wrapping_add(1))?;
        self.values.iter_mut().zip(values.iter()).for_each(|(place, value)| *place = value);
        self.newest = Some(of);
        Ok(())
    }

    fn check(&mut self, values: Floats<'_>, remote: u32, local: u32) -> Result<(), Refused> {
        let (expected, given) = (self.len, values.len());
        if expected != given {
            return Err(Refused::Length { expected, given });
        }
        if let Some(index) = values.iter().position(|value| !value.is_finite()) {
            return Err(Refused::NotFinite { index });
        }
        let in_range = |(i, value): (usize, f32)| self.ranges.get(i).is_some_and(|r| (r.low..=r.high).contains(&value));
        if !self.ranges.is_empty()
            && let Some(index) = values.iter().enumerate().position(|value| !in_range(value))
        {
            return Err(Refused::OutOfRange { index });
        }
        self.date(remote, local)
    }

    /// Checks the age of a frame that was sent at `remote` µs and received at `local` µs.
    ///
    /// # Errors
    ///
    /// [`Refused::Old`] or [`Refused::Ahead`].
    pub fn date(&mut self, remote: u32, local: u32) -> Result<(), Refused> {
        match self.age.of(remote, local, !self.is_bounded) {
            None => Err(Refused::Ahead),
            Some(age) if age > self.max_age => Err(Refused::Old { age }),
            Some(_) => Ok(()),
        }
    }

    /// Refuses jumps of the sender's time from now on, or ends that.
    pub fn bound(&mut self, is_bounded: bool) {
        self.is_bounded = is_bounded;
    }

    /// Returns the newest observation once, with its frame's number.
    pub fn newest(&mut self) -> Option<(u32, &[f32])> {
        Some((self.newest.take()?, self.values.get(..self.len)?))
    }

    /// Returns the largest accepted age of an observation, in µs.
    pub const fn max_age(&self) -> u32 {
        self.max_age
    }

    /// Sets the largest accepted age in µs, up to the build's limit.
    ///
    /// # Errors
    ///
    /// Returns [`Refusal::Range`] above the build's limit.
    pub fn set_max_age(&mut self, max_age: u32) -> Result<(), Refusal> {
        if max_age > self.built_max_age {
            return Err(Refusal::Range);
        }
        self.max_age = max_age;
        Ok(())
    }

    /// Resets the clock tracking and drops the observation that was not taken.
    pub fn reopen(&mut self) {
        self.age = Age::default();
        self.newest = None;
    }

    /// Returns the number of refused observations; wraps.
    pub const fn refused(&self) -> u32 {
        self.refused
    }

    /// Returns the length of an observation in values.
    pub const fn values(&self) -> usize {
        self.len
    }
}
