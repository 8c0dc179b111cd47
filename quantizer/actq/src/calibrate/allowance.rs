//! What statistics of an iterative head may take. Every frame runs its network once for each denoising step, so that
//! they would take minutes where learning was given one.

use std::time::{Duration, Instant};

/// The share of the time for learning that each of three may take: moments of inputs, moments of outputs, the choice of
/// activations.
const SHARE: u32 = 10;

/// Time on the clock for one of the statistics.
#[derive(Clone, Copy, Debug)]
pub struct Allowance(Duration);

impl Allowance {
    /// Of so much time for learning.
    pub fn of(learning: Duration) -> Self {
        Self(learning / SHARE)
    }

    /// How many of `most` units of work fit, at least `least`, where `some` are done to see what they take.
    pub fn fits(self, some: usize, work: impl FnOnce(), least: usize, most: usize) -> usize {
        let started = Instant::now();
        work();
        self.fits_at(started.elapsed().div_f64(some.max(1) as f64), least, most)
    }

    /// As [`Self::fits`], of units that take `each`.
    fn fits_at(self, each: Duration, least: usize, most: usize) -> usize {
        ((self.0.as_secs_f64() / each.as_secs_f64().max(f64::MIN_POSITIVE)) as usize).clamp(least.min(most), most)
    }
}

/// Of how many frames statistics were taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sampled {
    /// Frames of the recording.
    pub frames: usize,
    /// Those whose inputs of matrices were taken.
    pub inputs: usize,
    /// Drawn frames that the outputs were derived at; 0 where a method needs none.
    pub outputs: usize,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_is_bound_by_time_and_by_both_limits() {
        let of = |milliseconds, least, most| {
            let allowance = Allowance::of(SHARE * Duration::from_millis(milliseconds));
            allowance.fits_at(Duration::from_millis(2), least, most)
        };
        assert_eq!((of(40, 1, 1000), of(40, 30, 1000), of(10_000, 1, 7), of(40, 30, 7)), (20, 30, 7, 7));
        // Even units that take no time are counted.
        assert_eq!(Allowance::of(Duration::from_secs(1)).fits_at(Duration::ZERO, 1, 9), 9);
    }
}
