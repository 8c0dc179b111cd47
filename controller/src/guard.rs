//! What stands before the head: no observation gets there that is not whole, finite, in range and young.

use core::fmt;

use actq_link::Floats;
use actq_link::code::Refusal;

use crate::age::Age;

/// The range of one value of an observation, ends included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// The least.
    pub low: f32,
    /// The greatest.
    pub high: f32,
}

/// Why an observation does not get to the head.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refused {
    /// It has another number of values than the image takes.
    Length {
        /// Values that the image takes.
        expected: usize,
        /// Values that came.
        given: usize,
    },
    /// A value is NaN or infinite.
    NotFinite {
        /// Which.
        index: usize,
    },
    /// A value is outside its range.
    OutOfRange {
        /// Which.
        index: usize,
    },
    /// It took too long.
    Old {
        /// Age in µs.
        age: u32,
    },
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Length { expected, given } => write!(f, "{given} values, the image takes {expected}"),
            Self::NotFinite { index } => write!(f, "value {index} is not finite"),
            Self::OutOfRange { index } => write!(f, "value {index} is outside its range"),
            Self::Old { age } => write!(f, "{age} µs older than the fastest"),
        }
    }
}

impl core::error::Error for Refused {}

/// The newest observation that the guard let through, until the head takes it. `OBS` is room for the values.
#[derive(Debug)]
pub struct Guard<'r, const OBS: usize> {
    ranges: &'r [Range],
    /// Oldest age in µs.
    max_age: u32,
    /// What the build allows at most.
    built_max_age: u32,
    age: Age,
    values: [f32; OBS],
    len: usize,
    /// Sequence number of its frame.
    newest: Option<u32>,
    refused: u32,
}

impl<'r, const OBS: usize> Guard<'r, OBS> {
    /// A guard for observations of `len` values, each in its range; without `ranges` they only have to be finite.
    /// Values without a range (where there are fewer) are refused.
    ///
    /// `None` where there is no room for `len` values.
    pub fn new(len: usize, ranges: &'r [Range], max_age: u32) -> Option<Self> {
        (len <= OBS).then(|| Self { len, ..Self::full(ranges, max_age) })
    }

    /// As [`Self::new`], for observations of `OBS` values.
    pub fn full(ranges: &'r [Range], max_age: u32) -> Self {
        Self {
            ranges,
            max_age,
            built_max_age: max_age,
            age: Age::default(),
            values: [0.0; OBS],
            len: OBS,
            newest: None,
            refused: 0,
        }
    }

    /// Lets an observation through that was sent at `remote` µs and came at `local` µs. One that is refused is counted,
    /// and the last one stays.
    ///
    /// # Errors
    ///
    /// Why it is refused.
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
        let age = self.age.of(remote, local);
        if age > self.max_age {
            return Err(Refused::Old { age });
        }
        Ok(())
    }

    /// The newest observation with its frame's number, once.
    pub fn newest(&mut self) -> Option<(u32, &[f32])> {
        Some((self.newest.take()?, self.values.get(..self.len)?))
    }

    /// Age in µs above which an observation is refused.
    pub const fn max_age(&self) -> u32 {
        self.max_age
    }

    /// Sets it, not above that of the build.
    ///
    /// # Errors
    ///
    /// [`Refusal::Range`] where it is.
    pub fn set_max_age(&mut self, max_age: u32) -> Result<(), Refusal> {
        if max_age > self.built_max_age {
            return Err(Refusal::Range);
        }
        self.max_age = max_age;
        Ok(())
    }

    /// Forgets how the clocks stand to each other, and what was not taken.
    pub fn reopen(&mut self) {
        self.age = Age::default();
        self.newest = None;
    }

    /// Observations refused so far; wraps.
    pub const fn refused(&self) -> u32 {
        self.refused
    }

    /// Values of an observation.
    pub const fn values(&self) -> usize {
        self.len
    }
}
