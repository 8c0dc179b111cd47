//! The errors of this library: a cause of a known kind, and the context in which it occurred.

use std::error::Error as StdError;
use std::{fmt, io};

use actq_kernels::image::TooLarge;
use actq_kernels::layout::PackError;
use actq_kernels::{HeadError, ImageError, PrefixError, StepError};

use crate::budget::BudgetTooSmall;
pub use crate::{bail, ensure};

/// A value, or an [`Error`].
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// A cause and its contexts, outermost first. `{}` shows the outermost, `{:#}` all of them; each is the
/// [`source`](StdError::source) of the previous one.
#[derive(Debug)]
pub struct Error(Box<Link>);

#[derive(Debug)]
enum Link {
    Context(String, Error),
    Cause(Cause),
}

/// The cause of an error.
#[derive(Debug)]
#[non_exhaustive]
pub enum Cause {
    /// A policy, recording, image or option cannot be used as it is. The message names it and the remedy.
    Input(String),
    /// Even the smallest image exceeds the budget.
    Budget(BudgetTooSmall),
    /// The executor refuses an image.
    Image(ImageError),
    /// A file or stream cannot be read or written.
    Io(io::Error),
    /// An error of another crate, or of a function that the caller passed.
    Other(Box<dyn StdError + Send + Sync>),
}

impl Error {
    /// Makes an error of the caller's input.
    pub fn input(message: impl Into<String>) -> Self {
        Cause::Input(message.into()).into()
    }

    /// Wraps an error that this library does not know.
    pub fn other(error: impl Into<Box<dyn StdError + Send + Sync>>) -> Self {
        Cause::Other(error.into()).into()
    }

    /// Adds a context to this error.
    #[must_use]
    pub fn context(self, message: impl Into<String>) -> Self {
        Self(Box::new(Link::Context(message.into(), self)))
    }

    /// Returns the innermost error.
    pub fn cause(&self) -> &Cause {
        match &*self.0 {
            Link::Context(_, inner) => inner.cause(),
            Link::Cause(cause) => cause,
        }
    }

    /// Returns the budget that cannot be kept, if that is the cause.
    pub fn budget(&self) -> Option<&BudgetTooSmall> {
        if let Cause::Budget(budget) = self.cause() { Some(budget) } else { None }
    }
}

impl From<Cause> for Error {
    fn from(cause: Cause) -> Self {
        Self(Box::new(Link::Cause(cause)))
    }
}

macro_rules! from {
    ($($error:ty => $cause:expr),* $(,)?) => {
        $(impl From<$error> for Error {
            fn from(error: $error) -> Self {
                ($cause)(error).into()
            }
        })*
    };
}

from! {
    BudgetTooSmall => Cause::Budget,
    ImageError => Cause::Image,
    io::Error => Cause::Io,
    HeadError => Self::other,
    PrefixError => Self::other,
    PackError => Self::other,
    StepError => Self::other,
    TooLarge => Self::other,
    ndarray::ShapeError => Self::other,
    rayon::ThreadPoolBuildError => Self::other,
    safetensors::SafeTensorError => Self::other,
    serde_json::Error => Self::other,
    std::num::TryFromIntError => Self::other,
    std::str::Utf8Error => Self::other,
    std::string::FromUtf8Error => Self::other,
    zip::result::ZipError => Self::other,
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Input(message) => f.write_str(message),
            Self::Budget(error) => error.fmt(f),
            Self::Image(error) => error.fmt(f),
            Self::Io(error) => error.fmt(f),
            Self::Other(error) => write!(f, "{error}"),
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &*self.0 {
            Link::Context(message, inner) if f.alternate() => write!(f, "{message}: {inner:#}"),
            Link::Context(message, _) => f.write_str(message),
            Link::Cause(cause) => {
                write!(f, "{cause}")?;
                let mut source = self.source().filter(|_| f.alternate());
                while let Some(error) = source {
                    write!(f, ": {error}")?;
                    source = error.source();
                }
                Ok(())
            }
        }
    }
}

impl StdError for Error {
    fn source(&self) -> Option<&(dyn StdError + 'static)> {
        match &*self.0 {
            Link::Context(_, inner) => Some(inner),
            Link::Cause(Cause::Io(error)) => error.source(),
            Link::Cause(Cause::Other(error)) => error.source(),
            Link::Cause(_) => None,
        }
    }
}

/// Adds contexts to errors.
pub trait Context<T> {
    /// Adds a message.
    ///
    /// # Errors
    ///
    /// The error in this context; for an absent value, the message itself.
    fn context(self, message: impl Into<String>) -> Result<T>;

    /// Adds a message that is made only for an error.
    ///
    /// # Errors
    ///
    /// As [`Self::context`].
    fn with_context<M: Into<String>>(self, message: impl FnOnce() -> M) -> Result<T>;
}

impl<T, E: Into<Error>> Context<T> for Result<T, E> {
    fn context(self, message: impl Into<String>) -> Result<T> {
        self.with_context(|| message)
    }

    fn with_context<M: Into<String>>(self, message: impl FnOnce() -> M) -> Result<T> {
        self.map_err(|error| error.into().context(message()))
    }
}

impl<T> Context<T> for Option<T> {
    fn context(self, message: impl Into<String>) -> Result<T> {
        self.with_context(|| message)
    }

    fn with_context<M: Into<String>>(self, message: impl FnOnce() -> M) -> Result<T> {
        self.ok_or_else(|| Error::input(message()))
    }
}

/// Returns an [`Error::input`] with a formatted message.
#[macro_export]
macro_rules! bail {
    ($($message:tt)*) => {
        return Err($crate::error::Error::input(format!($($message)*)))
    };
}

/// Returns an [`Error::input`] with a formatted message unless a condition holds.
#[macro_export]
macro_rules! ensure {
    ($condition:expr, $($message:tt)*) => {{
        let holds: bool = $condition;
        if !holds {
            $crate::bail!($($message)*);
        }
    }};
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contexts_are_shown_outermost_first() {
        let missing = io::Error::from(io::ErrorKind::NotFound);
        let error = Err::<(), _>(missing).context("cannot read the file").context("weights").expect_err("an error");
        assert_eq!(format!("{error}"), "weights");
        assert_eq!(format!("{error:#}"), "weights: cannot read the file: entity not found");
        assert_eq!(error.source().map(ToString::to_string), Some("cannot read the file".to_owned()));
        assert!(matches!(error.cause(), Cause::Io(_)));
        let absent = None::<()>.context("nothing").expect_err("an error");
        assert!(matches!(absent.cause(), Cause::Input(message) if message == "nothing"));
    }
}
