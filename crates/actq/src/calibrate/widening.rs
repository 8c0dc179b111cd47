//! Noise on the inputs of learning.

use std::fmt;

/// Noise on a window of observations. Its standard deviation is drawn for every window, between 0 and `noise`, in units
/// of each value's own deviation over the recording. From step to step it keeps [`MEMORY`]. It imitates a rollout, in
/// which the policy's own errors leave the recorded path slowly and for a while. Noise that is independent in every
/// step averages out and teaches a recurrent policy to ignore it (figures: docs/records/2026-11-22-learning.md).
///
/// Half of the windows can also move as a whole, by up to `mix` times the difference of two recorded observations. This
/// preserves correlations between values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Widening {
    /// Largest standard deviation of the noise, in units of each value's own.
    pub noise: f32,
    /// Exponent of the uniform draw from 0 to 1 that `noise` is multiplied by: the higher, the more windows stay close
    /// to the recorded path.
    pub power: u32,
    /// Largest share of the difference of two recorded observations.
    pub mix: f32,
}

/// Share of the noise that remains from one step to the next: at 50 steps per second it lasts about 0.7 s.
pub const MEMORY: f32 = 0.97;

impl Widening {
    /// The widening of recurrent policies; it also measures errors off the path. A policy that balances needs as many
    /// windows far from the path as near it (docs/records/2026-11-22-choice.md and 2026-11-23-balance.md).
    pub const WIDE: Self = Self { noise: 0.8, power: 1, mix: 0.0 };
    /// The widening of other policies. Narrower ones have no lower error on the path, and twice as high ones off it
    /// (docs/records/2026-11-26-cells.md).
    pub const OF_FRAMES: Self = Self { noise: 0.8, power: 3, mix: 0.5 };

    /// Returns the widening of a policy.
    pub fn of(recurrent: bool) -> Self {
        if recurrent { Self::WIDE } else { Self::OF_FRAMES }
    }
}

impl fmt::Display for Widening {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "noise up to {} deviations", self.noise)?;
        if self.power > 1 {
            write!(f, " (mostly less)")?;
        }
        if self.mix > 0.0 { write!(f, " and mixing up to {}", self.mix) } else { Ok(()) }
    }
}
