//! Errors of all crates as one exception of Python.

use actq::text::printable;
use pyo3::exceptions::PyValueError;
use pyo3::{PyErr, PyResult, create_exception};

create_exception!(
    actq,
    Error,
    PyValueError,
    "A policy, recording, image, option or controller cannot be used as it is. The text is that of the command `actq`."
);

/// Returns the exception with the text that the command prints.
pub(crate) fn raise(error: impl Into<anyhow::Error>) -> PyErr {
    // A list of questions has several lines.
    let text = format!("{:#}", error.into());
    let lines: Vec<_> = text.split('\n').map(printable).collect();
    Error::new_err(lines.join("\n"))
}

/// Results whose errors become exceptions.
pub(crate) trait OrRaise<T> {
    fn or_raise(self) -> PyResult<T>;
}

impl<T, E: Into<anyhow::Error>> OrRaise<T> for Result<T, E> {
    fn or_raise(self) -> PyResult<T> {
        self.map_err(raise)
    }
}

/// Returns the exception with a formatted text.
macro_rules! error {
    ($($text:tt)*) => {
        $crate::error::Error::new_err(format!($($text)*))
    };
}

pub(crate) use error;
