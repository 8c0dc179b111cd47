//! Numbers for the values of a vector.

use serde::{Deserialize, Serialize};

/// One number for all values, or one for each.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Numbers {
    /// For all.
    All(f64),
    /// For each.
    Each(Vec<f64>),
}

impl Default for Numbers {
    fn default() -> Self {
        Self::All(0.0)
    }
}

impl Numbers {
    pub(super) fn is_zero(&self) -> bool {
        *self == Self::default()
    }
}
