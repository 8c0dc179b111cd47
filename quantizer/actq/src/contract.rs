//! What stands between the network's output and the robot.

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
    /// Of a first-order low-pass: the share of the way from the last action that each one goes, above 0 and at most 1.
    pub smoothing: Option<Vec<f32>>,
    /// The two states of actions that have only two.
    pub binarise: Option<Binarise>,
    /// How chunks are played.
    pub playback: Playback,
}

/// Actions that have two states; where both values are the same, the action is none of them.
#[derive(Clone, Debug)]
pub struct Binarise {
    /// From here on an action is on.
    pub on: Vec<f32>,
    /// Up to here it is off; between the two it stays what it was, and is off after a reset.
    pub off: Vec<f32>,
    /// What it is when it is on.
    pub on_value: Vec<f32>,
    /// What it is when it is off.
    pub off_value: Vec<f32>,
}

/// How chunks are played.
#[derive(Clone, Copy, Debug, Default)]
pub struct Playback {
    /// An average over chunks instead of one after the other.
    pub ensemble: Option<Ensemble>,
    /// Actions that lead over from what is left of the chunk before to a new one.
    pub overlap: usize,
    /// Age in control periods from which on an action never plays.
    pub deadline: Option<usize>,
}

/// Temporal ensembling (Zhao et al., Learning fine-grained bimanual manipulation with low-cost hardware, arXiv
/// 2304.13705): an action is the average of what the last chunks foresaw for it, the i-th of them weighted by
/// `exp(-m i)`, the oldest first.
#[derive(Clone, Copy, Debug)]
pub struct Ensemble {
    /// Chunks.
    pub horizon: usize,
    /// How fast the weights fall.
    pub m: f64,
}

impl Ensemble {
    /// The weight of the i-th chunk, then the reciprocals of the sums of the first i + 1 weights.
    pub fn weights(&self) -> Vec<f32> {
        let weights = || (0..self.horizon).map(|i| (-self.m * i as f64).exp());
        let mut sum = 0.0;
        let sums = weights().map(|weight| {
            sum += weight;
            1.0 / sum
        });
        weights().chain(sums).map(|v| v as f32).collect()
    }
}

impl Playback {
    /// That chunks of `chunk` actions, of which `execute` are executed, can be played so.
    ///
    /// # Errors
    ///
    /// What cannot be, by its key in policy.json, with the values that can.
    pub fn check(&self, chunk: usize, execute: usize) -> Result<()> {
        if let Some(ensemble) = self.ensemble {
            let Ensemble { horizon, m } = ensemble;
            ensure!((1..=chunk).contains(&horizon), "ensemble.horizon is {horizon}, it must be 1 to chunk ({chunk})");
            ensure!(execute == 1, "execute is {execute}, an ensemble runs the network every step: execute must be 1");
            ensure!(self.overlap == 0, "ensemble and overlap exclude each other: leave one of them");
            let possible = |v: &f32| *v > 0.0 && v.is_finite();
            let weights = ensemble.weights();
            ensure!(
                weights.iter().all(possible),
                "ensemble.m is {m:?}: exp(-m i) leaves float32's range within the horizon"
            );
        }
        let (overlap, rest) = (self.overlap, chunk - execute);
        ensure!(overlap <= rest, "overlap is {overlap}, of a chunk {rest} actions are left when the next one comes");
        if let Some(deadline) = self.deadline {
            let oldest = self.ensemble.map_or(execute, |ensemble| ensemble.horizon);
            let most = usize::from(u16::MAX);
            ensure!(
                (oldest..=most).contains(&deadline),
                "deadline is {deadline}, it must be {oldest} (what is played of a chunk) to {most}"
            );
        }
        Ok(())
    }
}

impl ActionContract {
    /// The arrays with their names, in the order of the image's flags.
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

    /// Lower and upper limit of action `i`, if it has both. (Where only other actions have some, f32's largest number is
    /// in their place.)
    pub fn limits(&self, i: usize) -> Option<[f32; 2]> {
        let of = |array: &Option<Vec<f32>>| array.as_ref()?.get(i).copied();
        Some([of(&self.low)?, of(&self.high)?]).filter(|[low, high]| *low > f32::MIN && *high < f32::MAX)
    }

    /// That each array has one finite value per action dimension, and that the limits can be kept.
    ///
    /// # Errors
    ///
    /// The array that does not fit, by its key in policy.json.
    pub fn check(&self, act_len: usize) -> Result<()> {
        for (name, array) in self.arrays() {
            let Some(array) = array else { continue };
            ensure!(array.len() == act_len, "action.{name} has {} values, act_dim is {act_len}", array.len());
            ensure!(array.iter().all(|v| v.is_finite()), "action.{name} holds a value that is not finite");
        }
        if let (Some(low), Some(high)) = (&self.low, &self.high) {
            ensure!(low.iter().zip(high).all(|(l, h)| l <= h), "action.low exceeds action.high");
        }
        ensure!(self.max_step.iter().flatten().all(|s| *s >= 0.0), "action.max_step holds a negative value");
        let share = |s: &f32| *s > 0.0 && *s <= 1.0;
        ensure!(self.smoothing.iter().flatten().all(share), "action.smoothing must be above 0 and at most 1");
        if let Some(Binarise { on, off, .. }) = &self.binarise {
            ensure!(off.iter().zip(on).all(|(off, on)| off <= on), "action.binarise.off exceeds action.binarise.on");
        }
        Ok(())
    }
}
