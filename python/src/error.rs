//! Errors of all crates as one exception of Python.

use actq::text::printable;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::{PyTypeInfo as _, create_exception};

create_exception!(
    actq,
    Error,
    PyValueError,
    "A policy, recording, image, option or controller cannot be used as it is. The text is that of the command `actq`."
);

/// Returns the exception with a formatted text.
macro_rules! error {
    ($($text:tt)*) => {
        $crate::error::Error::new_err(format!($($text)*))
    };
}

/// Returns the exception with the text that the command prints.
pub(crate) fn raise(error: impl Into<anyhow::Error>) -> PyErr {
    // A list of questions has several lines.
    let text = format!("{:#}", error.into());
    let lines: Vec<_> = text.split('\n').map(printable).collect();
    Error::new_err(lines.join("\n"))
}

/// As [`raise`], with the arguments of `import_policy` instead of the options of `actq import`.
pub(crate) fn raise_of_import(error: actq::error::Error) -> PyErr {
    Error::new_err(as_arguments(&printable(&format!("{error:#}"))))
}

/// Replaces options and their values by arguments, as `--observe gain` by `observe=["gain"]`.
fn as_arguments(text: &str) -> String {
    let mut text = text.replace("actq import --", "--");
    for argument in ["observe", "prefix", "output", "states"] {
        let option = &format!("--{} ", if argument == "states" { "state" } else { argument });
        let mut rest = std::mem::take(&mut text);
        while let Some(at) = rest.find(option) {
            let value = &rest[at + option.len()..];
            // Names have punctuation, as the colons of Keras, but do not end with it.
            let word = value.split(' ').next().unwrap_or_default();
            let (value, after) = value.split_at(word.trim_end_matches([';', ':', ',']).len());
            text += &rest[..at];
            text += &match (argument, value.split_once('=')) {
                ("observe" | "prefix", _) => format!("{argument}=[{value:?}]"),
                ("states", Some((from, to))) => format!("states={{{from:?}: {to:?}}}"),
                _ => format!("{argument}={value:?}"),
            };
            rest = after.to_owned();
        }
        text += &rest;
    }
    text
}

/// Extracts an argument. What Python or numpy cannot convert is this package's error, too.
pub(crate) fn given<'a, 'py, T: FromPyObject<'a, 'py>>(object: &'a Bound<'py, PyAny>) -> PyResult<T> {
    object.extract::<T>().map_err(|error| of_python(object.py(), error.into()))
}

/// Returns an error of Python with its text as the exception.
pub(crate) fn of_python(py: Python<'_>, error: PyErr) -> PyErr {
    if error.is_instance(py, &Error::type_object(py)) { error } else { error!("{}", error.value(py)) }
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

pub(crate) use error;
