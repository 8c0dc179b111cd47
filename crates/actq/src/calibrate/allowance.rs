//! Time limits for statistics of an iterative head. Every frame runs its network for each denoising step, so without a
//! limit they would take minutes if learning may take one.

use std::time::{Duration, Instant};

/// Divisor of the learning time that each of three statistics may take: moments of inputs, moments of outputs, the
/// choice of activations.
const SHARE: u32 = 10;

/// Time for one of the statistics.
#[derive(Clone, Copy, Debug)]
pub struct Allowance(Duration);

impl Allowance {
    /// Returns the allowance that belongs to a learning time.
    pub fn of(learning: Duration) -> Self {
        Self(learning / SHARE)
    }

    /// Returns how many of `most` units of work fit, at least `least`; `work` does `some` of them to measure their
    /// time.
    pub fn fits(self, some: usize, work: impl FnOnce(), least: usize, most: usize) -> usize {
        let started = Instant::now();
        work();
        self.fits_at(started.elapsed().div_f64(some.max(1) as f64), least, most)
    }

    /// As [`Self::fits`], for units that take the time `each`.
    fn fits_at(self, each: Duration, least: usize, most: usize) -> usize {
        ((self.0.as_secs_f64() / each.as_secs_f64().max(f64::MIN_POSITIVE)) as usize).clamp(least.min(most), most)
    }
}

/// Frames that statistics were taken over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sampled {
    /// Frames of the recording.
    pub frames: usize,
    /// Frames over which inputs of matrices were taken.
    pub inputs: usize,
    /// Drawn frames at which the outputs were derived; 0 if a method needs none.
    pub outputs: usize,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_and_both_limits_bound_the_work() {
        let of = |milliseconds, least, most| {
            let allowance = Allowance::of(SHARE * Duration::from_millis(milliseconds));
            allowance.fits_at(Duration::from_millis(2), least, most)
        };
        assert_eq!((of(40, 1, 1000), of(40, 30, 1000), of(10_000, 1, 7), of(40, 30, 7)), (20, 30, 7, 7));
        // Units that take no time are counted, too.
        assert_eq!(Allowance::of(Duration::from_secs(1)).fits_at(Duration::ZERO, 1, 9), 9);
    }
}
