//! How far learning takes the inputs off the recorded ones.

use std::fmt;

/// Noise on a window of observations. Its standard deviation is drawn for every window, between 0 and `noise`, in units
/// of each value's own deviation over the recording; from step to step it keeps [`MEMORY`]. Where a policy drives, its
/// own errors have taken it off the recorded path, slowly and for a while: that is what such noise stands for. Noise
/// that is fresh in every step averages out and teaches a recurrent policy to ignore it (docs/QUANTIZER.md has the
/// figures).
///
/// Half of the windows can also be moved as a whole, by up to `mix` times the difference of two recorded observations,
/// which keeps the values together that move together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Widening {
    /// The largest standard deviation of the noise, in units of each value's own.
    pub noise: f32,
    /// It is drawn as `noise` times this power of an even draw from 0 to 1: the higher, the more windows stay close to
    /// the recorded path.
    pub power: i32,
    /// The largest share of the difference of two recorded observations.
    pub mix: f32,
}

/// What remains of the noise from one step to the next: at 50 steps a second it lasts for about 0.7 s.
pub const MEMORY: f32 = 0.97;

impl Widening {
    /// What a recurrent policy learns with, and what others take where nothing can be left out to choose by; errors off
    /// the path are measured with it. A policy that balances needs as many windows far from the path as near it
    /// (docs/records/2026-11-22-choice.md and 2026-11-23-balance.md).
    pub const WIDE: Self = Self { noise: 0.8, power: 1, mix: 0.0 };

    /// What can be chosen from. The first of a feed-forward policy has lower errors than [`Self::WIDE`] on its path and
    /// hardly higher ones off it. Of a recurrent policy nothing narrower has the lowest error off the path, so there is
    /// no choice.
    pub fn choices(recurrent: bool) -> &'static [Self] {
        const OF_FRAMES: [Widening; 3] = [
            Widening { noise: 0.8, power: 3, mix: 0.5 },
            Widening { noise: 0.1, power: 1, mix: 0.5 },
            Widening { noise: 0.1, power: 1, mix: 1.0 },
        ];
        if recurrent { &[Self::WIDE] } else { &OF_FRAMES }
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
