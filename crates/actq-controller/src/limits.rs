//! Limits of an axis in a build's notation: `LOW:HIGH` or `LOW:HIGH:RATE`, in the unit of the actions.

use core::fmt;
use core::str::FromStr;

/// Finite limits of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Lowest value.
    pub low: f32,
    /// Highest value, not below `low`.
    pub high: f32,
    /// Largest change in a second, above 0; with `None` the firmware chooses.
    pub rate: Option<f32>,
}

/// Reason why a text is not a valid limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LimitsError {
    /// The text has fewer than two parts or more than three.
    Parts,
    /// A part is not a finite number.
    Number,
    /// The lower limit exceeds the upper one.
    Reversed,
    /// The rate is not positive.
    Rate,
}

impl fmt::Display for LimitsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Parts => "limits have the form LOW:HIGH or LOW:HIGH:RATE",
            Self::Number => "limits are finite numbers: LOW:HIGH or LOW:HIGH:RATE",
            Self::Reversed => "the lower limit exceeds the upper one; the form is LOW:HIGH",
            Self::Rate => "the rate, the largest change in a second, must be above 0",
        })
    }
}

impl core::error::Error for LimitsError {}

impl Limits {
    /// Returns the limits of axis `i`: the stricter of the image's and the build's. `built` has limits for each axis,
    /// or one for all; the image's may be infinite. Returns `None` without finite limits, and if the two do not
    /// overlap.
    pub fn of_axis(i: usize, image: Option<[f32; 2]>, built: &[Self]) -> Option<Self> {
        let image = image.map(|[low, high]| Self { low, high, rate: None });
        let limits = match (image, built.get(i).or(built.first())) {
            (Some(image), Some(built)) => built.within(image),
            (image, built) => image.or(built.copied()),
        };
        limits.filter(|limits| limits.low.is_finite() && limits.high.is_finite())
    }

    fn within(self, other: Self) -> Option<Self> {
        let low = if other.low > self.low { other.low } else { self.low };
        let high = if other.high < self.high { other.high } else { self.high };
        (low <= high).then_some(Self { low, high, ..self })
    }
}

impl FromStr for Limits {
    type Err = LimitsError;

    fn from_str(text: &str) -> Result<Self, LimitsError> {
        let mut parts = text.split(':');
        let (Some(low), Some(high), rate, None) = (parts.next(), parts.next(), parts.next(), parts.next()) else {
            return Err(LimitsError::Parts);
        };
        let (low, high, rate) = (number(low)?, number(high)?, rate.map(number).transpose()?);
        if low > high {
            return Err(LimitsError::Reversed);
        }
        if rate.is_some_and(|rate| rate <= 0.0) {
            return Err(LimitsError::Rate);
        }
        Ok(Self { low, high, rate })
    }
}

impl fmt::Display for Limits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.low, self.high)?;
        self.rate.map_or(Ok(()), |rate| write!(f, ":{rate}"))
    }
}

fn number(text: &str) -> Result<f32, LimitsError> {
    text.trim().parse().ok().filter(|number: &f32| number.is_finite()).ok_or(LimitsError::Number)
}
