//! Networks.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// A network.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Network {
    /// Name; `NAME.OUTPUT` names the value of an output.
    pub name: String,
    /// ONNX file beside the description.
    pub file: String,
    /// Value of each of the graph's inputs.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub inputs: BTreeMap<String, String>,
    /// Inputs that take the value of an output of the tick before, and that output; zero at a reset.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub states: BTreeMap<String, String>,
}
