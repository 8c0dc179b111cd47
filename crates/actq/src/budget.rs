//! The budget of an image, and what it allows the weights.

use std::fmt;

use actq_kernels::Width;
use actq_kernels::cost::Core;
use serde::{Deserialize, Serialize};

/// The budget of an image, in the unit that was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Budget {
    /// One width for every matrix.
    Width(#[serde(with = "bits")] Width),
    /// The most bits per weight of all matrices together, with scales and padding.
    BitsPerWeight(f64),
    /// The most bytes of the whole image.
    ImageBytes(usize),
    /// The largest error (NMSE); the fewest bits that keep it are used.
    MaxNmse(f64),
    /// The longest predicted step, and with it the most bytes of the image.
    Time(TimeLimit),
}

/// Shows the budget with its unit, as in "2.5 bits".
impl fmt::Display for Budget {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Width(width) => write!(f, "width {}", width.bits()),
            Self::BitsPerWeight(bits) => write!(f, "{bits} bits"),
            Self::ImageBytes(bytes) => write!(f, "{bytes} bytes"),
            Self::MaxNmse(nmse) => write!(f, "NMSE {nmse}"),
            Self::Time(TimeLimit { milliseconds, image_bytes: None, .. }) => write!(f, "{milliseconds} ms"),
            Self::Time(TimeLimit { milliseconds, image_bytes: Some(bytes), .. }) => {
                write!(f, "{milliseconds} ms, {bytes} bytes")
            }
        }
    }
}

/// The longest step, in milliseconds at a clock.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimeLimit {
    /// Milliseconds.
    pub milliseconds: f64,
    /// The core.
    #[serde(default = "m4f", skip_serializing_if = "is_m4f", with = "core_name")]
    pub core: Core,
    /// The core's clock in Hz.
    pub clock_hz: f64,
    /// The most bytes of the whole image; `None`: no limit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub image_bytes: Option<usize>,
}

fn m4f() -> Core {
    Core::M4f
}

fn is_m4f(core: &Core) -> bool {
    *core == Core::M4f
}

/// A core by its name.
pub(crate) mod core_name {
    use actq_kernels::cost::Core;
    use serde::de::{Deserialize, Deserializer, Error as _};
    use serde::ser::Serializer;

    pub(crate) fn serialize<S: Serializer>(core: &Core, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(core.name())
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Core, D::Error> {
        let name = String::deserialize(deserializer)?;
        Core::of_name(&name).ok_or_else(|| D::Error::custom(format!("no core {name:?}")))
    }
}

/// The least used share of a budget, if more bits fit and reduce the error.
pub const MIN_USED_SHARE: f64 = 0.97;

/// The bits or bytes that the weights may take; every method works to a rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rate {
    /// One width for every matrix.
    Width(Width),
    /// The most bits per weight of all matrices together, with scales and padding.
    BitsPerWeight(f64),
    /// The most bytes of all that a method decides on: the weights, everything counted, and the vectors that it changes
    /// ([`crate::graph::Graph::changed_vectors`]).
    Bytes(usize),
    /// The most bytes, as [`Self::Bytes`], or `None`, and the most modelled cycles of what a method decides on.
    Within {
        /// Bytes.
        bytes: Option<usize>,
        /// Cycles.
        cycles: f64,
        /// The core that takes them.
        core: Core,
    },
}

impl Rate {
    /// Returns the bytes that `weights` weights may take; infinite if they have no limit.
    pub fn bytes(self, weights: usize) -> f64 {
        match self {
            Self::Width(_) => f64::INFINITY,
            Self::BitsPerWeight(bits) => bits * weights as f64 / 8.0,
            Self::Bytes(bytes) => bytes as f64,
            Self::Within { bytes, .. } => bytes.map_or(f64::INFINITY, |bytes| bytes as f64),
        }
    }

    /// Returns the core whose cycles are limited; without a limit a Cortex-M4 with FPU.
    pub fn core(self) -> Core {
        if let Self::Within { core, .. } = self { core } else { Core::M4f }
    }

    /// Returns the modelled cycles that rows may take, if they are limited.
    pub fn cycles(self) -> Option<f64> {
        match self {
            Self::Within { cycles, .. } => Some(cycles),
            Self::Width(_) | Self::BitsPerWeight(_) | Self::Bytes(_) => None,
        }
    }
}

/// The error of a budget that even the narrowest widths exceed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BudgetTooSmall {
    /// The fewest bytes of the weights, or of the whole image.
    pub bytes: usize,
    /// The allowed bytes.
    pub limit: f64,
    /// Weights of the policy.
    pub weights: usize,
    /// `true` if the budget is for the whole image.
    pub image: bool,
}

impl BudgetTooSmall {
    /// Refuses a limit for the weights below the fewest bytes that they take.
    pub fn check(bytes: usize, limit: f64, weights: usize) -> Result<(), Self> {
        if bytes as f64 <= limit { Ok(()) } else { Err(Self { bytes, limit, weights, image: false }) }
    }

    /// Returns the same error for an image of at most `limit` bytes that has `fixed` bytes beside the weights.
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
                "the budget is too small: the smallest image of this policy by this method takes {bytes} bytes, and the limit is \
                 {limit}; allow {bytes} bytes or more"
            );
        }
        let bits = |bytes: f64| 8.0 * bytes / weights.max(1) as f64;
        // Round up, so that the named budget can be kept.
        let enough = (1000.0 * bits(bytes as f64)).ceil() / 1000.0;
        write!(
            f,
            "the budget is too small: with scales and padding the weights take at least {bytes} bytes, and the limit is \
             {limit:.0} ({:.3} bits per weight); allow {enough:.3} bits per weight or more",
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
        Width::from_bits(bits).ok_or_else(|| D::Error::custom(format!("no width has {bits} bits; use 2, 3, 4 or 8")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn budgets_survive_serialization() {
        let time = Budget::Time(TimeLimit { milliseconds: 1.5, core: Core::M4f, clock_hz: 168e6, image_bytes: None });
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
