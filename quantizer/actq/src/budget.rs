//! What an image may cost, and what that leaves for the weights.

use std::fmt;

use actq_kernels::Width;
use serde::{Deserialize, Serialize};

/// What an image may cost, in the unit that was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Budget {
    /// One width for every matrix.
    Width(#[serde(with = "bits")] Width),
    /// The widths that keep the whole below this many bits per weight, everything counted.
    BitsPerWeight(f64),
    /// The widths that keep the whole image within this many bytes.
    ImageBytes(usize),
    /// The fewest bits whose error (NMSE) is at most this.
    MaxNmse(f64),
    /// The most bits whose predicted step takes at most this long.
    Time(TimeLimit),
}

/// The largest number of milliseconds that a step may take, at a clock.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimeLimit {
    /// Milliseconds.
    pub milliseconds: f64,
    /// The processor's clock in Hz.
    pub clock_hz: f64,
}

/// The share of a budget that is used at least, where more bits reduce the error and fit.
pub const USED: f64 = 0.97;

/// How many bits the weights may take: what every method works to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rate {
    /// One width for every matrix.
    Width(Width),
    /// The widths that keep the whole below this many bits per weight, everything counted.
    BitsPerWeight(f64),
    /// The widths that keep all that a method decides on within this many bytes: the weights, everything counted, and
    /// the vectors that it changes ([`crate::graph::Graph::changed_vectors`]).
    Bytes(usize),
}

impl Rate {
    /// Bytes that `weights` weights may take; infinite where the width is given.
    pub fn bytes(self, weights: usize) -> f64 {
        match self {
            Self::Width(_) => f64::INFINITY,
            Self::BitsPerWeight(bits) => bits * weights as f64 / 8.0,
            Self::Bytes(bytes) => bytes as f64,
        }
    }
}

/// The error of a budget that not even the narrowest widths keep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BudgetTooSmall {
    /// The fewest bytes of what the budget is for.
    pub bytes: usize,
    /// What is allowed.
    pub limit: f64,
    /// Weights of the policy.
    pub weights: usize,
    /// Whether the budget is for the whole image.
    pub image: bool,
}

impl BudgetTooSmall {
    /// Refuses a limit for the weights below the fewest bytes that they take.
    pub fn check(bytes: usize, limit: f64, weights: usize) -> Result<(), Self> {
        if bytes as f64 <= limit { Ok(()) } else { Err(Self { bytes, limit, weights, image: false }) }
    }

    /// The same for an image of at most `limit` bytes, which has `fixed` bytes beside those.
    pub fn in_image(self, fixed: usize, limit: usize) -> Self {
        Self { bytes: self.bytes + fixed, limit: limit as f64, image: true, ..self }
    }
}

impl fmt::Display for BudgetTooSmall {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { bytes, limit, weights, image } = *self;
        if image {
            return write!(
                f,
                "the budget is too small: the smallest image of this policy by this method takes {bytes} bytes, {limit} are \
                 allowed; allow {bytes} bytes or more"
            );
        }
        let bits = |bytes: f64| 8.0 * bytes / weights.max(1) as f64;
        // Rounded up, so that the budget that is named can be kept.
        let enough = (1000.0 * bits(bytes as f64)).ceil() / 1000.0;
        write!(
            f,
            "the budget is too small: with scales and padding the weights take at least {bytes} bytes, {limit:.0} are \
             allowed ({:.3} bits a weight); allow {enough:.3} bits a weight or more",
            bits(limit)
        )
    }
}

impl std::error::Error for BudgetTooSmall {}

/// A width as its number of bits.
mod bits {
    use actq_kernels::Width;
    use serde::de::{Deserialize, Deserializer, Error};
    use serde::ser::Serializer;

    pub(super) fn serialize<S: Serializer>(width: &Width, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_u32(width.bits())
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Width, D::Error> {
        let bits = u32::deserialize(deserializer)?;
        Width::from_bits(bits).ok_or_else(|| D::Error::custom(format!("no width has {bits} bits")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_budget_is_read_as_it_was_written() {
        let time = Budget::Time(TimeLimit { milliseconds: 1.5, clock_hz: 168e6 });
        for (budget, json) in [
            (Budget::Width(Width::W3), r#"{"width":3}"#),
            (Budget::BitsPerWeight(2.5), r#"{"bits_per_weight":2.5}"#),
            (Budget::ImageBytes(98304), r#"{"image_bytes":98304}"#),
            (Budget::MaxNmse(0.01), r#"{"max_nmse":0.01}"#),
            (time, r#"{"time":{"milliseconds":1.5,"clock_hz":168000000.0}}"#),
        ] {
            assert_eq!(serde_json::to_string(&budget).expect("JSON"), json);
            assert_eq!(serde_json::from_str::<Budget>(json).expect("a budget"), budget);
        }
        assert!(serde_json::from_str::<Budget>(r#"{"width":5}"#).is_err(), "no width has 5 bits");
    }
}
