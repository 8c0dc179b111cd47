//! What is said of a learning.

use crate::calibrate::widening::Widening;

/// What was learned of a network beside its weights.
#[derive(Clone, Debug)]
pub struct Learning {
    /// Steps taken.
    pub steps: usize,
    /// How far the inputs were widened.
    pub widening: Widening,
    /// What was tried to choose that.
    pub tried: Vec<Tried>,
}

/// A choice and its error on the episodes that were left out: the mean over samples and outputs of squared error over variance.
#[derive(Clone, Copy, Debug)]
pub struct Tried {
    /// The choice.
    pub widening: Widening,
    /// At the recorded observations.
    pub recorded: f64,
    /// At observations widened by [`Widening::WIDE`].
    pub widened: f64,
}
