//! What stands between the network's output and the robot.

use anyhow::{Result, ensure};

/// The action contract; each array has one value per action dimension, or is absent. In the order in which they apply.
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
}

impl ActionContract {
    /// The arrays with their names, in the order of the image's flags.
    pub fn arrays(&self) -> [(&'static str, &Option<Vec<f32>>); 5] {
        [
            ("scale", &self.scale),
            ("offset", &self.offset),
            ("low", &self.low),
            ("high", &self.high),
            ("max_step", &self.max_step),
        ]
    }

    /// That each array has one finite value per action dimension, and that the limits can be kept.
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
        Ok(())
    }
}
