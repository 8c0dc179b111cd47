//! One result.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use actq::pipeline::driven::DriveOutcome;

use super::limits::Limit;
use super::plan::Contender;

/// The key of a result: a policy, its method and its budget; without a method the f32 policy.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CellKey {
    /// The policy's name.
    pub policy: String,
    /// The method.
    pub method: Option<Contender>,
    /// Budget of the image.
    pub budget: Option<Limit>,
}

impl CellKey {
    /// Returns the human-readable name.
    pub(super) fn title(&self) -> String {
        match (self.method, self.budget) {
            (Some(method), Some(budget)) => format!("{}, {} at {}", self.policy, method.title(), budget.title()),
            _ => format!("{}, f32", self.policy),
        }
    }
}

/// The image of a cell.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Made {
    /// Error on the held-out recording.
    pub nmse: f64,
    /// Predicted milliseconds of a step at the default clock; `None` if no kernel computes the format.
    pub milliseconds: Option<f64>,
    /// The same with products by CMSIS-NN's int8 kernel
    /// ([`cmsis_nn_milliseconds`](crate::student::form::cmsis_nn_milliseconds)); `None` for other codes, and in results
    /// of earlier versions.
    #[serde(default)]
    pub cmsis_nn_milliseconds: Option<f64>,
    /// Bits per weight, everything counted.
    pub bpw: f64,
    /// Bytes of the image.
    pub bytes: usize,
    /// Bytes of the image per parameter of the trained policy.
    pub bytes_per_parameter: f64,
    /// Weights that share a scale: `row`, or a number of columns; for K-quants the format of each matrix; for rivals
    /// the widths, too.
    pub format: String,
    /// `true` for the method's default group.
    pub default_group: bool,
}

impl Made {
    /// Returns the predicted milliseconds with the faster of our kernels and CMSIS-NN's.
    pub(super) fn fewest_milliseconds(&self) -> Option<f64> {
        self.milliseconds.into_iter().chain(self.cmsis_nn_milliseconds).min_by(f64::total_cmp)
    }
}

/// The result of a job that makes an image.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Attempted {
    /// The image.
    pub(super) made: Option<Made>,
    /// Reason if no image is possible.
    pub(super) why: Option<String>,
}

/// A result.
#[derive(Clone, Debug)]
pub struct Cell {
    /// Key.
    pub key: CellKey,
    /// The image; none for the f32 policy.
    pub made: Option<Made>,
    /// Reason if no image is possible.
    pub why: Option<String>,
    /// Output of the closed loop; `None` without one.
    pub driven: Option<Value>,
    /// Seconds of the job that made the image, if the log has them.
    pub seconds: Option<f64>,
}

impl Cell {
    /// Parses the output of the closed loop.
    pub(super) fn outcome(&self) -> Option<DriveOutcome> {
        DriveOutcome::parse(&self.driven.as_ref()?.to_string())
    }
}
