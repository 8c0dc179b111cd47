//! The result of a job, as its file in the store.

use serde::{Deserialize, Serialize};

use crate::figures::{CustomResult, Driven, Evaluated, JobResult};
use crate::results::Merged;

/// The version of the files: 2 since results end in their checksum.
pub const FORMAT: u32 = 2;

/// A job's result.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Record {
    /// [`FORMAT`].
    pub format: u32,
    /// The job's address.
    pub address: String,
    /// Version of the package that made it.
    pub version: String,
    /// The result.
    pub result: Outcome,
}

/// A result.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(tag = "kind", content = "value", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Outcome {
    /// An image, in `ADDRESS.actq`.
    Made(JobResult),
    /// The reason why no image is within the budget. Jobs that need the image have the same result.
    Impossible(String),
    /// Errors on the held-out recording.
    Evaluated(Evaluated),
    /// Outcome of closed-loop episodes.
    Driven(Driven),
    /// The results of a plan.
    Merged(Merged),
    /// Result of a job of kind custom.
    Custom(CustomResult),
}

#[cfg(test)]
mod tests {
    use super::Outcome;

    #[test]
    fn results_of_earlier_stores_are_read() {
        let made = r#"{"kind":"made","value":{"image":"","bytes":0,"cycles":0,"bpw":1.5,"steps":0,"frames":0,"matrices":[],
            "rows":[{"2":3}],"scores":[]}}"#;
        for text in [made, r#"{"kind":"impossible","value":"no image"}"#] {
            serde_json::from_str::<Outcome>(text).expect("a result");
        }
    }
}
