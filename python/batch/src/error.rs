//! The errors of a batch.

use std::fmt;

use actq_kernels::{ImageError, PrefixError, SavedError, StepError};

/// Why a batch was not made, or a call failed. [`Batch::step`](crate::Batch::step) says what an error leaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Error {
    /// The image is refused.
    Image(ImageError),
    /// A batch of no heads.
    NoHeads,
    /// The memory for the heads is not available.
    Memory {
        /// Heads of the batch.
        heads: usize,
    },
    /// The observations of all heads have another number of values.
    Observations {
        /// Values expected.
        expected: usize,
        /// Values given.
        given: usize,
    },
    /// The room for the actions of all heads has another number of values.
    Actions {
        /// Values expected.
        expected: usize,
        /// Values given.
        given: usize,
    },
    /// The reset mask has another number of values than the batch has heads.
    Reset {
        /// Heads of the batch.
        expected: usize,
        /// Values given.
        given: usize,
    },
    /// The number of seeds is not that of the heads.
    Seeds {
        /// Heads of the batch.
        expected: usize,
        /// Seeds given.
        given: usize,
    },
    /// The saved states of all heads have another number of bytes.
    States {
        /// Bytes expected.
        expected: usize,
        /// Bytes given.
        given: usize,
    },
    /// The state of a head was not saved or restored; it is the first of those.
    Saved {
        /// Index of the head in the batch.
        head: usize,
        /// Its error.
        error: SavedError,
    },
    /// The prefixes of all heads have another number of bytes.
    Prefixes {
        /// Bytes expected.
        expected: usize,
        /// Bytes given.
        given: usize,
    },
    /// The prefix of a head was not set; it is the first of those.
    Prefix {
        /// Index of the head in the batch.
        head: usize,
        /// Its error.
        error: PrefixError,
    },
    /// A head gave no action; it is the first of those that gave none.
    Head {
        /// Index of the head in the batch.
        head: usize,
        /// Its error.
        error: StepError,
    },
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Image(error) => write!(f, "{error}"),
            Self::NoHeads => f.write_str("a batch has at least one head"),
            Self::Memory { heads } => write!(f, "not enough memory for {heads} heads; use fewer"),
            Self::Observations { expected, given } => {
                write!(f, "the observations have {given} values; the batch needs {expected}")
            }
            Self::Actions { expected, given } => {
                write!(f, "the actions have room for {given} values; the batch needs {expected}")
            }
            Self::Reset { expected, given } => {
                write!(f, "the reset mask has {given} values; the batch has {expected} heads")
            }
            Self::Seeds { expected, given } => write!(f, "{given} seeds were given; the batch has {expected} heads"),
            Self::States { expected, given } => write!(f, "the states have {given} bytes; the batch needs {expected}"),
            Self::Saved { head, error } => write!(f, "state {head}: {error}"),
            Self::Prefixes { expected, given } => {
                write!(f, "the prefixes have {given} bytes; the batch needs {expected}")
            }
            Self::Prefix { head, error } => write!(f, "prefix {head}: {error}"),
            Self::Head { head, error } => write!(f, "head {head}: {error}"),
        }
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Image(error) => Some(error),
            Self::Saved { error, .. } => Some(error),
            Self::Prefix { error, .. } => Some(error),
            Self::Head { error, .. } => Some(error),
            _ => None,
        }
    }
}

impl From<ImageError> for Error {
    fn from(error: ImageError) -> Self {
        Self::Image(error)
    }
}
