//! A report of how a network's codes were chosen.

use std::fmt;

use crate::calibrate::widening::Widening;

/// Settings of learning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Recipe {
    /// Noise on the inputs.
    pub widening: Widening,
    /// Factor on the learning rates.
    pub rate: f32,
    /// Factor on the expected error of rounding when widths are allocated. The higher, the fewer rows with more bits.
    pub rounding: f64,
    /// `true` if all hidden vectors count alike when elements are removed.
    pub even: bool,
}

impl Recipe {
    /// Returns the settings with this noise and no factors.
    pub fn new(widening: Widening) -> Self {
        Self { widening, rate: 1.0, rounding: 1.0, even: false }
    }
}

impl fmt::Display for Recipe {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { widening, rate, rounding, even } = self;
        write!(f, "{widening}")?;
        if *rate != 1.0 {
            write!(f, ", rate x{rate}")?;
        }
        if *rounding != 1.0 {
            write!(f, ", rounding x{rounding}")?;
        }
        if *even { f.write_str(", even layers") } else { Ok(()) }
    }
}

/// Way in which codes are chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Choice {
    /// Learning with these settings.
    Learning(Recipe),
    /// Two-sided error feedback.
    Feedback {
        /// Share of the mean that is added to the diagonals of the inputs' moments.
        damping: f64,
    },
}

impl Choice {
    /// Returns the settings of learning.
    pub fn recipe(self) -> Option<Recipe> {
        match self {
            Self::Learning(recipe) => Some(recipe),
            Self::Feedback { .. } => None,
        }
    }
}

impl fmt::Display for Choice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Learning(recipe) => write!(f, "learning with {recipe}"),
            Self::Feedback { damping } => write!(f, "error feedback, damping {damping}"),
        }
    }
}

/// Result of choosing a network's codes.
#[derive(Clone, Debug)]
pub struct Learning {
    /// Steps of learning; 0 if nothing was learned.
    pub steps: usize,
    /// Steps of learning that were discarded, since they ended with a higher error than they began with, or than
    /// feedback has.
    pub discarded: usize,
    /// Selected way.
    pub choice: Choice,
    /// Ways that were compared.
    pub tried: Vec<Trial>,
}

/// A choice and its errors: the mean over samples and outputs of squared error over variance. Learning is compared with
/// feedback on held-out episodes, and settings of learning on all.
#[derive(Clone, Copy, Debug)]
pub struct Trial {
    /// The choice.
    pub choice: Choice,
    /// Error at the recorded observations.
    pub recorded: f64,
    /// Error at observations widened by [`Widening::WIDE`].
    pub widened: f64,
}
