//! The failure of a job, and whether another try can succeed.

use std::fmt;

use actq::error::{Cause, Error};

/// Exit status of a process whose job can be tried again; `EX_TEMPFAIL` of sysexits.h.
pub const AGAIN: u8 = 75;

/// A failed job.
#[derive(Debug)]
pub struct JobError {
    /// `true` if the same job may succeed later: a full disk, a missing result of another job, a command that asked for
    /// it. `false` if every try fails: wrong input, or an error of the computation.
    pub again: bool,
    /// The error.
    pub error: Error,
}

impl JobError {
    /// Makes a failure that another try may not repeat.
    pub fn again(error: impl Into<Error>) -> Self {
        Self { again: true, error: error.into() }
    }

    /// Makes a failure that every try repeats.
    pub fn never(error: impl Into<Error>) -> Self {
        Self { again: false, error: error.into() }
    }

    /// Adds a context to the error.
    #[must_use]
    pub fn context(self, message: impl Into<String>) -> Self {
        Self { again: self.again, error: self.error.context(message) }
    }
}

/// Errors of files may go away, as a full disk or a lost connection do, unless the file does not exist. Others stay.
impl From<Error> for JobError {
    fn from(error: Error) -> Self {
        let again = matches!(error.cause(), Cause::Io(io) if io.kind() != std::io::ErrorKind::NotFound);
        Self { again, error }
    }
}

impl fmt::Display for JobError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.error.fmt(f)
    }
}

impl std::error::Error for JobError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.error.source()
    }
}
