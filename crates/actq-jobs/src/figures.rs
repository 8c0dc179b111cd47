//! Figures of images: what jobs find out, and what merging makes of it.

use std::collections::BTreeMap;

use actq::measure::eval::ErrorSums;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::work::Episodes;

/// An image.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JobResult {
    /// SHA-256 of the image.
    pub image: String,
    /// Its bytes.
    pub bytes: usize,
    /// Predicted cycles of a step on a Cortex-M4 with FPU.
    pub cycles: u64,
    /// True bits per weight of the matrices, with scales and padding; biases and header do not count.
    pub bpw: f64,
    /// Steps of distillation that were taken.
    pub steps: usize,
    /// Recorded frames that it learned from.
    pub frames: usize,
    /// Names of the policy's matrices.
    pub matrices: Vec<String>,
    /// Bit allocation: for each matrix of the image, the number of trained rows of each width (0: no bits).
    pub rows: Vec<BTreeMap<u32, usize>>,
    /// Figures of a custom method per matrix; empty for other methods.
    pub scores: Vec<BTreeMap<String, f64>>,
}

/// Errors on episodes of the held-out recording.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Evaluated {
    /// The episodes.
    pub episodes: Episodes,
    /// Sums that give the errors.
    pub sums: ErrorSums,
}

/// Outcome of closed-loop episodes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Driven {
    /// Episodes.
    pub episodes: u64,
    /// Successful ones; `None` if the command does not report them.
    pub successes: Option<u64>,
    /// Other numbers that the command reported.
    pub numbers: BTreeMap<String, f64>,
    /// SHA-256 of the observations, in `ADDRESS.npz`, if they were to be kept.
    pub recording: Option<String>,
}

/// Result of a job of kind custom.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CustomResult {
    /// The result.
    pub value: Value,
    /// The file beside it.
    pub file: Option<KeptFile>,
}

/// A file beside the result of a job of kind custom.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KeptFile {
    /// Ending of its name.
    pub ending: String,
    /// SHA-256 of its content.
    pub sha256: String,
}

impl Driven {
    /// Adds other episodes of the same image: counts add up, other numbers are means over the episodes. A number that
    /// one part does not have is dropped.
    #[must_use]
    pub fn join(&self, other: &Self) -> Self {
        let share = other.episodes as f64 / (self.episodes + other.episodes).max(1) as f64;
        let both = self.numbers.iter().filter_map(|(key, own)| Some((key, own, other.numbers.get(key)?)));
        Self {
            episodes: self.episodes + other.episodes,
            successes: self.successes.zip(other.successes).map(|(own, others)| own + others),
            numbers: both.map(|(key, own, others)| (key.clone(), own + share * (others - own))).collect(),
            recording: None,
        }
    }
}
