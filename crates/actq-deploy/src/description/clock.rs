//! Phases that advance with the ticks.

use serde::{Deserialize, Serialize};

/// A phase.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Clock {
    /// Name.
    pub name: String,
    /// Phases at a reset, one for each leg or one in all.
    pub start: Vec<f64>,
    /// Advance in a tick.
    pub advance: f64,
    /// Time of the advance: before or after the tick reads it.
    #[serde(default)]
    pub when: When,
    /// Interval that phases are wrapped to: from the first number, to below the second.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wrap: Option<[f64; 2]>,
    /// Number above which a phase restarts at 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub restart_above: Option<f64>,
    /// Phases of a robot that stands.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub standing: Option<Standing>,
}

impl Clock {
    /// Makes a clock of one phase that starts at 0 and has no end.
    pub fn from_zero(name: &str, advance: f64, when: When) -> Self {
        let (name, start) = (name.to_owned(), vec![0.0]);
        Self { name, start, advance, when, wrap: None, restart_above: None, standing: None }
    }
}

/// When a clock advances.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum When {
    /// Before the tick reads it: the first tick has one advance.
    Before,
    /// After the tick has read it: the first tick has the start.
    #[default]
    After,
}

/// Condition under which a robot stands, and its clock's phases then. When it moves again, the clock restarts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Standing {
    /// Values whose Euclidean norms decide, each by itself.
    pub of: Vec<String>,
    /// The robot stands if every norm is below this number.
    pub below: f64,
    /// Phases while it stands.
    pub at: Vec<f64>,
}
