//! Numbers for the values of a vector.

use serde::{Deserialize, Serialize};

use super::value::Operand;

/// One number for all values, or one for each.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "give a number, or a list of numbers")]
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
    pub(crate) fn operand(&self) -> Operand {
        match self {
            Self::All(number) => Operand::Number(*number),
            Self::Each(list) => Operand::List(list.clone()),
        }
    }

    pub(super) fn is_zero(&self) -> bool {
        *self == Self::default()
    }
}
