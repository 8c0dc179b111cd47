//! A report of how a network's codes were chosen.

use std::fmt;

use crate::calibrate::widening::Widening;

/// Way in which codes are chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Choice {
    /// Learning with inputs widened by this noise.
    Learning(Widening),
    /// Two-sided error feedback.
    Feedback {
        /// Share of the mean that is added to the diagonals of the inputs' moments.
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

/// Result of choosing a network's codes.
#[derive(Clone, Debug)]
pub struct Learning {
    /// Steps of learning; 0 if nothing was learned.
    pub steps: usize,
    /// Selected way.
    pub choice: Choice,
    /// Ways that were compared.
    pub tried: Vec<Tried>,
}

/// A choice and its errors on held-out episodes: the mean over samples and outputs of squared error over variance.
#[derive(Clone, Copy, Debug)]
pub struct Tried {
    /// The choice.
    pub choice: Choice,
    /// Error at the recorded observations.
    pub recorded: f64,
    /// Error at observations widened by [`Widening::WIDE`].
    pub widened: f64,
}
