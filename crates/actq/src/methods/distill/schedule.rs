//! Duration and learning rate of a distillation.
//!
//! The rate is constant as long as the error falls; then it falls to zero along a cosine, over 3 in 10 of all steps. So
//! learning ends when it has converged or reaches a limit. The result equals that of a schedule planned for this
//! length: at equal steps, it is no worse than a cosine from the first step on (docs/records/2026-11-22-learning.md).

use std::time::{Duration, Instant};

use actq_kernels::math;

use crate::graph::Graph;
use crate::methods::options::Effort;

/// Share of the steps at the full rate.
const FULL_RATE_SHARE: f64 = 0.7;
/// Most steps of a network of [`REFERENCE_WEIGHTS`] weights. The steps of others follow the square root of the size: a
/// small network learns longer, and the time of a large one does not grow as much. A step costs more for an iterative
/// head, in which a frame has one evaluation per denoising step. A batch of a recurrent network's windows costs four
/// times as much.
const FRAME_STEPS: f64 = 8_000.0;
const DENOISING_HEAD_STEPS: f64 = 5_000.0;
const WINDOW_STEPS: f64 = 4_000.0;
const REFERENCE_WEIGHTS: f64 = 200_000.0;
/// Most steps of any network.
const MAX_STEPS: f64 = 10_000.0;
/// Parts of the most steps; the mean error of each shows whether the error falls. Least steps of a part.
const ERROR_PARTS: usize = 16;
const MIN_PART_STEPS: usize = 100;
/// Least relative fall below the lowest earlier part. Learning ends after [`MAX_FLAT_PARTS`] parts in a row without it.
const MIN_FALL: f64 = 0.01;
const MAX_FLAT_PARTS: usize = 2;

/// Returns the most steps of a network.
pub fn most_steps(graph: &Graph, effort: Effort) -> usize {
    let usual = match graph.state_len() > 0 {
        true => WINDOW_STEPS,
        false if graph.denoising_steps() > 1 => DENOISING_HEAD_STEPS,
        false => FRAME_STEPS,
    };
    (effort.factor() * scaled(usual, graph.weights()) as f64) as usize
}

/// Returns the steps of a network of this many weights.
fn scaled(usual: f64, weights: usize) -> usize {
    (usual * (REFERENCE_WEIGHTS / weights.max(1) as f64).sqrt()).min(MAX_STEPS) as usize
}

/// Limits of learning.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    /// Most steps; without them, [`Self::time`] is the limit.
    pub steps: Option<usize>,
    /// Most time on the clock. The result then depends on the machine.
    pub time: Option<Duration>,
}

/// State of learning.
#[derive(Debug)]
pub struct Schedule {
    bounds: Bounds,
    started: Instant,
    /// Steps of a part.
    part: usize,
    step: usize,
    /// Steps at the full rate, as soon as the rate falls.
    held: Option<usize>,
    /// Sum of the present part's errors, mean of the last part, lowest mean, and number of parts since that were not
    /// lower.
    sum: f64,
    last: Option<f64>,
    lowest: f64,
    flat: usize,
}

impl Schedule {
    /// Starts at the first step; `usual` is the number of steps for the size of the network.
    pub fn new(bounds: Bounds, usual: usize) -> Self {
        let part = (bounds.steps.unwrap_or(usual) / ERROR_PARTS).max(MIN_PART_STEPS);
        Self {
            bounds,
            started: Instant::now(),
            part,
            step: 0,
            held: None,
            sum: 0.0,
            last: None,
            lowest: f64::INFINITY,
            flat: 0,
        }
    }

    /// Returns the steps taken.
    pub fn steps(&self) -> usize {
        self.step
    }

    /// Returns `true` if a part has just ended.
    pub fn is_at_part(&self) -> bool {
        self.step.is_multiple_of(self.part)
    }

    /// Returns the mean error of the last whole part, or of the first one so far.
    pub fn error(&self) -> Option<f64> {
        self.last.or_else(|| (self.step > 0).then(|| self.sum / self.step as f64))
    }

    /// Returns the factor of the rates for the next step; `None` at the end.
    pub fn rate(&mut self) -> Option<f32> {
        if self.held.is_none() && (self.flat >= MAX_FLAT_PARTS || self.share() >= FULL_RATE_SHARE) {
            self.held = Some(self.step);
        }
        let Some(held) = self.held else { return Some(1.0) };
        let falls = ((held as f64 * (1.0 - FULL_RATE_SHARE) / FULL_RATE_SHARE).round() as usize).max(1);
        let fallen = self.step - held;
        let most = self.bounds.steps.unwrap_or(usize::MAX);
        if fallen >= falls || self.step >= most {
            return None;
        }
        Some(0.5 * (1.0 + math::cos(std::f32::consts::PI * fallen as f32 / falls as f32)))
    }

    /// Records a step with its error.
    pub fn took(&mut self, error: f32) {
        self.step += 1;
        self.sum += f64::from(error);
        if self.is_at_part() {
            let mean = self.sum / self.part as f64;
            (self.sum, self.last) = (0.0, Some(mean));
            self.flat = if mean < (1.0 - MIN_FALL) * self.lowest { 0 } else { self.flat + 1 };
            self.lowest = self.lowest.min(mean);
        }
    }

    /// Returns the share that is done: of the limit at the full rate, of the remaining steps while it falls.
    pub fn share(&self) -> f64 {
        if let Some(held) = self.held {
            return (self.step as f64 * FULL_RATE_SHARE / held.max(1) as f64).min(1.0);
        }
        let of_steps = self.bounds.steps.map_or(0.0, |most| self.step as f64 / most.max(1) as f64);
        let of_time = self.bounds.time.map_or(0.0, |time| self.started.elapsed().as_secs_f64() / time.as_secs_f64());
        of_steps.max(of_time).min(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn learn(steps: usize, error: impl Fn(usize) -> f32) -> Vec<f32> {
        let mut schedule = Schedule::new(Bounds { steps: Some(steps), time: None }, steps);
        let mut rates = Vec::new();
        while let Some(rate) = schedule.rate() {
            rates.push(rate);
            schedule.took(error(rates.len()));
        }
        assert_eq!(schedule.steps(), rates.len());
        rates
    }

    #[test]
    fn falling_errors_use_all_steps() {
        for steps in [1, 2, 10, 999, 16_000] {
            let rates = learn(steps, |step| 1.0 / step as f32);
            assert_eq!(rates.len(), steps);
            assert!(rates.is_sorted_by(|a, b| a >= b) && rates[0] == 1.0);
        }
        assert!(learn(16_000, |step| 1.0 / step as f32)[15_999] < 1e-5);
    }

    #[test]
    fn learning_ends_when_the_error_stops_falling() {
        let rates = learn(16_000, |step| if step <= 4000 { 1.0 / step as f32 } else { 1.0 });
        // Two parts of 1,000 steps without a fall, then the fall of the rate.
        let held = rates.iter().filter(|rate| **rate == 1.0).count();
        assert!((6000..=6001).contains(&held), "{held}");
        assert_eq!(rates.len(), 6000 + 2571);
    }

    #[test]
    fn time_limits_learning() {
        let bounds = Bounds { steps: None, time: Some(Duration::from_millis(50)) };
        let mut schedule = Schedule::new(bounds, 1000);
        while schedule.rate().is_some() {
            std::thread::sleep(Duration::from_millis(1));
            schedule.took(1.0 / (schedule.steps() + 1) as f32);
        }
        // A busy machine takes fewer; a sleep is never shorter than asked.
        assert!((1..=50).contains(&schedule.steps()), "{}", schedule.steps());
    }

    #[test]
    fn small_networks_take_more_steps() {
        assert_eq!(scaled(WINDOW_STEPS, 50_000), 8_000);
        assert_eq!([10, 200_000, 800_000].map(|weights| scaled(FRAME_STEPS, weights)), [10_000, 8_000, 4_000]);
    }
}
