//! The action contract, between the network's output and the robot.

use crate::error::{Result, ensure};

/// The action contract; each array has one value per action dimension, or is absent. `docs/FORMAT.md` has the order in
/// which they apply.
#[derive(Clone, Debug, Default)]
pub struct ActionContract {
    /// Factors.
    pub scale: Option<Vec<f32>>,
    /// Offsets.
    pub offset: Option<Vec<f32>>,
    /// Lower limits.
    pub low: Option<Vec<f32>>,
    /// Upper limits.
    pub high: Option<Vec<f32>>,
    /// Largest change from one action to the next.
    pub max_step: Option<Vec<f32>>,
    /// Coefficient of a first-order low-pass: the share of the way from the last action to the new one, above 0 and at
    /// most 1.
    pub smoothing: Option<Vec<f32>>,
    /// Thresholds and values of actions that have only two states.
    pub binarise: Option<Binarise>,
    /// Playback of chunks.
    pub playback: Playback,
}

/// Actions with two states. An action whose two values are equal is not binarized.
#[derive(Clone, Debug)]
pub struct Binarise {
    /// Value from which on an action is on.
    pub on: Vec<f32>,
    /// Value up to which an action is off. Between `off` and `on` it keeps its state; it is off after a reset.
    pub off: Vec<f32>,
    /// Value of an action that is on.
    pub on_value: Vec<f32>,
    /// Value of an action that is off.
    pub off_value: Vec<f32>,
}

/// Playback of chunks.
#[derive(Clone, Copy, Debug, Default)]
pub struct Playback {
    /// Temporal ensemble; without it, chunks are played one after the other.
    pub ensemble: Option<Ensemble>,
    /// Actions over which the rest of the previous chunk blends into a new one.
    pub overlap: usize,
    /// Age in control periods from which on an action never plays.
    pub deadline: Option<usize>,
}

/// Temporal ensemble (Zhao et al., Learning fine-grained bimanual manipulation with low-cost hardware, arXiv
/// 2304.13705): an action is the average of what the last chunks predicted for it. The i-th chunk, the oldest first,
/// has the weight `exp(-m i)`.
#[derive(Clone, Copy, Debug)]
pub struct Ensemble {
    /// Chunks in the average.
    pub horizon: usize,
    /// Decay rate of the weights.
    pub m: f64,
}

impl Ensemble {
    /// Returns the weights of the chunks, then the reciprocals of the sums of the first i + 1 weights.
    pub fn weights(&self) -> Vec<f32> {
        let weights = || (0..self.horizon).map(|i| libm::exp(-self.m * i as f64));
        let mut sum = 0.0;
        let sums = weights().map(|weight| {
            sum += weight;
            1.0 / sum
        });
        weights().chain(sums).map(|v| v as f32).collect()
    }
}

impl Playback {
    /// Checks that chunks of `chunk` actions, of which `execute` are executed, can be played in this way.
    ///
    /// # Errors
    ///
    /// Names the key in policy.json that does not fit, with the values that do.
    pub fn check(&self, chunk: usize, execute: usize) -> Result<()> {
        if let Some(ensemble) = self.ensemble {
            let Ensemble { horizon, m } = ensemble;
            ensure!((1..=chunk).contains(&horizon), "ensemble.horizon is {horizon}; it must be 1 to chunk ({chunk})");
            ensure!(
                execute == 1,
                "execute is {execute}; an ensemble runs the network every step, so execute must be 1"
            );
            ensure!(self.overlap == 0, "ensemble and overlap exclude each other: remove one of them");
            let possible = |v: &f32| *v > 0.0 && v.is_finite();
            let weights = ensemble.weights();
            ensure!(
                weights.iter().all(possible),
                "ensemble.m is {m:?}: exp(-m i) leaves float32's range within the horizon"
            );
        }
        let (overlap, rest) = (self.overlap, chunk - execute);
        ensure!(
            overlap <= rest,
            "overlap is {overlap}, but only {rest} actions of a chunk are left when the next one comes"
        );
        if let Some(deadline) = self.deadline {
            let oldest = self.ensemble.map_or(execute, |ensemble| ensemble.horizon);
            let most = usize::from(u16::MAX);
            ensure!(
                (oldest..=most).contains(&deadline),
                "deadline is {deadline}; it must be {oldest} (the played actions of a chunk) to {most}"
            );
        }
        Ok(())
    }
}

impl ActionContract {
    /// Returns the arrays with their names, in the order of the image's flags.
    pub fn arrays(&self) -> [(&'static str, Option<&Vec<f32>>); 10] {
        let binarise = self.binarise.as_ref();
        [
            ("scale", self.scale.as_ref()),
            ("offset", self.offset.as_ref()),
            ("low", self.low.as_ref()),
            ("high", self.high.as_ref()),
            ("max_step", self.max_step.as_ref()),
            ("smoothing", self.smoothing.as_ref()),
            ("binarise.on", binarise.map(|b| &b.on)),
            ("binarise.off", binarise.map(|b| &b.off)),
            ("binarise.on_value", binarise.map(|b| &b.on_value)),
            ("binarise.off_value", binarise.map(|b| &b.off_value)),
        ]
    }

    /// Returns whether an action depends on earlier ones.
    pub fn has_memory(&self) -> bool {
        let Self { max_step, smoothing, binarise, playback: Playback { ensemble, overlap, .. }, .. } = self;
        max_step.is_some() || smoothing.is_some() || binarise.is_some() || ensemble.is_some() || *overlap > 0
    }

    /// Returns action `i` of the network's output: scaled, offset and limited. The other arrays act on executed actions.
    pub fn apply(&self, i: usize, raw: f32) -> f32 {
        let of = |array: &Option<Vec<f32>>| array.as_ref().map(|values| values[i]);
        let action = raw * of(&self.scale).unwrap_or(1.0) + of(&self.offset).unwrap_or(0.0);
        // `max` and `min` make a limit of NaN.
        if action.is_nan() {
            return action;
        }
        let action = of(&self.low).map_or(action, |low| action.max(low));
        of(&self.high).map_or(action, |high| action.min(high))
    }

    /// Returns the lower and upper limit of action `i`, if it has both. If only other actions have some, f32's largest
    /// number stands in their place.
    pub fn limits(&self, i: usize) -> Option<[f32; 2]> {
        let of = |array: &Option<Vec<f32>>| array.as_ref()?.get(i).copied();
        Some([of(&self.low)?, of(&self.high)?]).filter(|[low, high]| *low > f32::MIN && *high < f32::MAX)
    }

    /// Checks that each array has one finite value per action dimension, and that the limits can be kept.
    ///
    /// # Errors
    ///
    /// Names the array that does not fit by its key in policy.json.
    pub fn check(&self, act_len: usize) -> Result<()> {
        for (name, array) in self.arrays() {
            let Some(array) = array else { continue };
            ensure!(array.len() == act_len, "action.{name} has {} values, but act_dim is {act_len}", array.len());
            ensure!(array.iter().all(|v| v.is_finite()), "action.{name} holds a value that is not finite");
        }
        if let (Some(low), Some(high)) = (&self.low, &self.high) {
            ensure!(low.iter().zip(high).all(|(l, h)| l <= h), "action.low exceeds action.high");
        }
        ensure!(self.max_step.iter().flatten().all(|s| *s >= 0.0), "action.max_step holds a negative value");
        for (i, step) in self.max_step.iter().flatten().enumerate() {
            let largest = self.limits(i).map_or(0.0, |[low, high]| high.max(-low));
            ensure!(
                *step == 0.0 || *step >= f32::EPSILON * largest,
                "action.max_step[{i}] is {step:e}, which float32 rounds away beside the limit {largest}, so that the action would \
                 stand still; give it a larger change in a step"
            );
        }
        let share = |s: &f32| *s > 0.0 && *s <= 1.0;
        ensure!(self.smoothing.iter().flatten().all(share), "action.smoothing must be above 0 and at most 1");
        if let Some(Binarise { on, off, .. }) = &self.binarise {
            ensure!(off.iter().zip(on).all(|(off, on)| off <= on), "action.binarise.off exceeds action.binarise.on");
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_that_rounding_swallows_are_refused() {
        let of = |step: f32| {
            let [low, high, max_step] = [vec![-1e6], vec![4e5], vec![step]].map(Some);
            ActionContract { low, high, max_step, ..ActionContract::default() }.check(1)
        };
        assert!(of(0.0).is_ok() && of(0.12).is_ok());
        let error = format!("{:#}", of(0.1).expect_err("f32 rounds it away"));
        assert!(
            error.starts_with("action.max_step[0] is 1e-1, which float32 rounds away beside the limit 1000000"),
            "{error}"
        );
    }
}
