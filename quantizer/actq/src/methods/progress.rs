//! How far a quantization is.

use std::fmt;

/// What is being done, with the share of it that is done. Errors are squared differences to the f32 network over the
/// variance of its outputs, at the widened inputs of learning: they fall, but are not those of a recording.
#[derive(Clone, Copy, Debug)]
pub enum Progress {
    /// How far to widen the inputs is being chosen.
    Choosing {
        /// Share done of the whole.
        share: f64,
        /// The error so far.
        error: f64,
    },
    /// Learning.
    Learning {
        /// Share done of the whole.
        share: f64,
        /// The error so far.
        error: f64,
    },
}

impl Progress {
    /// Share of the whole that is done.
    pub fn share(self) -> f64 {
        let (Self::Choosing { share, .. } | Self::Learning { share, .. }) = self;
        share
    }
}

impl fmt::Display for Progress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Choosing { error, .. } => write!(f, "choosing, error {error:.1e}"),
            Self::Learning { error, .. } => write!(f, "learning, error {error:.1e}"),
        }
    }
}
