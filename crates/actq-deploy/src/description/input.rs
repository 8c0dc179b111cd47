//! Raw inputs and states.

use serde::{Deserialize, Serialize};

use super::numbers::Numbers;

/// A raw input.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Input {
    /// Name.
    pub name: String,
    /// Number of values; may be omitted with `joints`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub len: Option<usize>,
    /// Order of its values: a list of `joints`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joints: Option<String>,
    /// Unit, human-readable.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Lowest and highest value that a guard accepts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range: Option<[f64; 2]>,
}

/// A value that is kept from one tick to the next.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct State {
    /// Name.
    pub name: String,
    /// Number of values.
    pub len: usize,
    /// Its value in the first tick after a reset; one number stands for all.
    #[serde(default, skip_serializing_if = "Numbers::is_zero")]
    pub start: Numbers,
    /// Value of this tick that it has in the next.
    pub next: String,
}
