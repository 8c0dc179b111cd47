//! Progress of a quantization.

use std::fmt;

/// The present work, and the share of the whole that is done. Errors are squared differences to the f32 network over
/// the variance of its outputs, at the widened inputs of learning. They fall, but are not the errors on a recording.
/// Only the held-out error is one.
#[derive(Clone, Copy, Debug)]
pub enum Progress {
    /// Comparing learning with feedback.
    Choosing {
        /// Share of the whole that is done.
        share: f64,
        /// Present error.
        error: f64,
    },
    /// Learning.
    Learning {
        /// Share of the whole that is done.
        share: f64,
        /// Present error.
        error: f64,
        /// Error of late on some of the held-out recording, if there is one. Nothing goes by it.
        held_out: Option<f64>,
    },
}

impl Progress {
    /// Returns the share of the whole that is done.
    pub fn share(self) -> f64 {
        let (Self::Choosing { share, .. } | Self::Learning { share, .. }) = self;
        share
    }
}

impl fmt::Display for Progress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Choosing { error, .. } => write!(f, "choosing, error {error:.1e}"),
            Self::Learning { error, held_out: Some(held_out), .. } => {
                write!(f, "learning, error {error:.1e}, held-out {held_out:.1e}")
            }
            Self::Learning { error, .. } => write!(f, "learning, error {error:.1e}"),
        }
    }
}
