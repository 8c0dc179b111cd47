//! One result.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use actq::pipeline::driven::DriveOutcome;

use super::plan::Contender;

/// Which result: a policy, and what it was quantized by and to; without a method the f32 policy itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CellKey {
    /// The policy's name.
    pub policy: String,
    /// The method.
    pub method: Option<Contender>,
    /// Bits per weight that were allowed.
    pub budget: Option<f64>,
}

impl CellKey {
    /// For people.
    pub(super) fn title(&self) -> String {
        match (self.method, self.budget) {
            (Some(method), Some(budget)) => format!("{}, {} at {budget} bits", self.policy, method.title()),
            _ => format!("{}, f32", self.policy),
        }
    }
}

/// What was made.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Made {
    /// Error on the held-out recording.
    pub nmse: f64,
    /// Bits per weight, everything counted.
    pub bpw: f64,
    /// Bytes of the image.
    pub bytes: usize,
    /// The image's bytes over the parameters of the policy as it was trained.
    pub bytes_per_parameter: f64,
    /// What has a scale: `row`, or so many columns; of K-quants the format of each matrix.
    pub format: String,
    /// Whether the group is the method's default one.
    pub default_group: bool,
    /// Statistics and quantization; the simulator runs at the same time.
    pub seconds: f64,
}

/// A line of the journal.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Cell {
    /// Which.
    #[serde(flatten)]
    pub key: CellKey,
    /// What was made; of the f32 policy nothing.
    pub made: Option<Made>,
    /// Why nothing could be made.
    pub why: Option<String>,
    /// What the closed loop said; `None` where there was none.
    pub driven: Option<Value>,
    /// How long the closed loop took.
    pub drive_seconds: f64,
}

impl Cell {
    /// What the closed loop said.
    pub(super) fn outcome(&self) -> Option<DriveOutcome> {
        DriveOutcome::parse(&self.driven.as_ref()?.to_string())
    }
}
