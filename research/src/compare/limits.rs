//! The budget of a cell.

use std::cmp::Ordering;
use std::fmt;

use actq::budget::{Budget, TimeLimit};
use actq::emit::Core;
use actq::measure::time::CLOCK;
use serde::{Deserialize, Serialize};

/// Budget of an image: a number of bits per weight, or, with `K` or `B`, of KiB or bytes of flash, or, with `ms`, of
/// milliseconds of a step at [`CLOCK`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Limit {
    /// Bits per weight, everything counted.
    Bits(f64),
    /// Bytes of the whole image.
    Flash {
        /// Bytes.
        flash: usize,
    },
    /// Predicted time of a step.
    Time {
        /// Milliseconds.
        ms: f64,
    },
}

impl Limit {
    /// Parses a budget of the command line.
    ///
    /// # Errors
    ///
    /// Names what a budget may be.
    pub fn parse(text: &str) -> Result<Self, String> {
        let text = text.trim();
        let bytes = |digits: &str, unit: usize| digits.parse().ok().and_then(|n: usize| n.checked_mul(unit));
        let time = |digits: &str| digits.parse().ok().filter(|ms| *ms > 0.0 && f64::is_finite(*ms));
        let found = match (text.strip_suffix('K'), text.strip_suffix('B'), text.strip_suffix("ms")) {
            (Some(digits), ..) => bytes(digits, 1024).filter(|n| *n > 0).map(|flash| Self::Flash { flash }),
            (_, Some(digits), _) => bytes(digits, 1).filter(|n| *n > 0).map(|flash| Self::Flash { flash }),
            (.., Some(digits)) => time(digits).map(|ms| Self::Time { ms }),
            _ => text.parse().ok().filter(|bits| (0.1..=16.0).contains(bits)).map(Self::Bits),
        };
        found.ok_or_else(|| {
            format!(
                "{text:?} is not a number of bits per weight from 0.1 to 16, of KiB as 12K, of bytes as 12000B, or of \
                 milliseconds as 0.25ms"
            )
        })
    }

    /// Returns the quantizer's budget.
    pub fn budget(self) -> Budget {
        match self {
            Self::Bits(bits) => Budget::BitsPerWeight(bits),
            Self::Flash { flash } => Budget::ImageBytes(flash),
            Self::Time { ms } => {
                Budget::Time(TimeLimit { milliseconds: ms, core: Core::M4f, clock_hz: CLOCK, image_bytes: None })
            }
        }
    }

    /// Orders from few bits to many, then from few bytes to many, then from short to long.
    pub fn order(&self, other: &Self) -> Ordering {
        let key = |allowed: &Self| match *allowed {
            Self::Bits(bits) => (0, bits),
            Self::Flash { flash } => (1, flash as f64),
            Self::Time { ms } => (2, ms),
        };
        let ((a, x), (b, y)) = (key(self), key(other));
        a.cmp(&b).then(x.total_cmp(&y))
    }

    /// Returns the human-readable budget: `2.5 bits`, `12K of flash`.
    pub fn title(self) -> String {
        match self {
            Self::Bits(_) => format!("{self} bits"),
            Self::Flash { .. } => format!("{self} of flash"),
            Self::Time { .. } => format!("{self} a step"),
        }
    }
}

impl fmt::Display for Limit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Bits(bits) => write!(f, "{bits}"),
            Self::Flash { flash } if flash.is_multiple_of(1024) => write!(f, "{}K", flash / 1024),
            Self::Flash { flash } => write!(f, "{flash}B"),
            Self::Time { ms } => write!(f, "{ms}ms"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn budgets_survive_text_and_journal() {
        for (text, budget) in [
            ("1.5", Budget::BitsPerWeight(1.5)),
            ("12K", Budget::ImageBytes(12_288)),
            ("10001B", Budget::ImageBytes(10_001)),
            (
                "0.25ms",
                Budget::Time(TimeLimit { milliseconds: 0.25, core: Core::M4f, clock_hz: CLOCK, image_bytes: None }),
            ),
        ] {
            let allowed = Limit::parse(text).expect("a budget");
            assert_eq!((allowed.budget(), allowed.to_string().as_str()), (budget, text));
            let json = serde_json::to_string(&allowed).expect("JSON");
            assert_eq!(serde_json::from_str::<Limit>(&json).expect("a budget"), allowed);
        }
        assert_eq!(serde_json::from_str::<Limit>("2.5").expect("of former journals"), Limit::Bits(2.5));
        for text in ["", "0", "17", "0K", "K", "1.5K", "ms", "0ms", "-1ms", "infms", "1msms"] {
            assert!(Limit::parse(text).is_err(), "{text}");
        }
    }
}
