//! Tables with one row a tick.

use serde::{Deserialize, Serialize};

/// A table with one row a tick.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Motion {
    /// Name.
    pub name: String,
    /// File beside the description: .npz or .npy.
    pub file: String,
    /// Array `[row, value]` in the file.
    pub array: String,
    /// Ticks by which the rows are late: row 0 is read until tick `lag`.
    #[serde(default)]
    pub lag: usize,
    /// Continuation after the last row.
    #[serde(default)]
    pub end: End,
}

/// Continuation after the last row of a motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum End {
    /// The last row stays.
    #[default]
    Hold,
    /// The first row comes again.
    Repeat,
}
