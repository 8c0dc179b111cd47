//! Histories of a value.

use serde::{Deserialize, Serialize};

/// A history.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct History {
    /// Number of frames.
    pub length: usize,
    /// Ticks from a frame to the next.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub stride: usize,
    /// Frame that comes first.
    #[serde(default)]
    pub first: First,
    /// Content before the first tick.
    #[serde(default)]
    pub fill: Fill,
    /// `true` if the newest frame is this tick's; else the previous tick's.
    #[serde(default = "yes", skip_serializing_if = "is_yes")]
    pub current: bool,
}

fn one() -> usize {
    1
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
fn is_one(n: &usize) -> bool {
    *n == 1
}

fn yes() -> bool {
    true
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
fn is_yes(flag: &bool) -> bool {
    *flag
}

/// The frame that comes first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum First {
    /// The oldest.
    #[default]
    Oldest,
    /// The newest.
    Newest,
}

/// Content of a history after a reset.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fill {
    /// Zeros.
    #[default]
    Zero,
    /// The frame of the first tick.
    First,
}
