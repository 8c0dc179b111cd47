//! What is said of how a network's codes were chosen.

use std::fmt;

use crate::calibrate::widening::Widening;

/// How codes are chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Choice {
    /// They are learned, with inputs widened so far.
    Learning(Widening),
    /// By two-sided error feedback, with this share of the mean added to the diagonals of the inputs' moments.
    Feedback {
        /// The share.
        damping: f64,
    },
}

impl fmt::Display for Choice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Learning(widening) => write!(f, "learning with {widening}"),
            Self::Feedback { damping } => write!(f, "error feedback, damping {damping}"),
        }
    }
}

/// How a network's codes were chosen.
#[derive(Clone, Debug)]
pub struct Learning {
    /// Steps of learning; 0 where nothing was learned.
    pub steps: usize,
    /// The way.
    pub choice: Choice,
    /// What was tried to find it.
    pub tried: Vec<Tried>,
}

/// A choice and its error on the episodes that were left out: the mean over samples and outputs of squared error over
/// variance.
#[derive(Clone, Copy, Debug)]
pub struct Tried {
    /// The choice.
    pub choice: Choice,
    /// At the recorded observations.
    pub recorded: f64,
    /// At observations widened by [`Widening::WIDE`].
    pub widened: f64,
}
