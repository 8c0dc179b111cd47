//! Labels of single numbers, for messages.

use std::fmt;

/// Meaning of a number of a value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Label {
    /// Value that it is part of, as one would name it in an observation.
    pub value: String,
    /// Its joint, or its place in that value.
    pub element: String,
    /// Ticks since it was current, if it is in a history.
    pub age: Option<usize>,
}

impl Label {
    /// Returns the label of this number as it was some ticks ago.
    pub(crate) fn older(&self, age: usize) -> Self {
        Self { age: Some(self.age.unwrap_or(0) + age), ..self.clone() }
    }
}

impl fmt::Display for Label {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}[{}]", self.value, self.element)?;
        match self.age {
            None => Ok(()),
            Some(0) => f.write_str(" of this tick"),
            Some(1) => f.write_str(" of the tick before"),
            Some(age) => write!(f, " of {age} ticks before"),
        }
    }
}

/// Returns the labels of a value, by its joints' names if they are given.
pub(crate) fn labels(value: &str, len: usize, joints: Option<&[String]>) -> Vec<Label> {
    let element = |i: usize| joints.and_then(|joints| joints.get(i)).cloned().unwrap_or_else(|| i.to_string());
    (0..len).map(|i| Label { value: value.to_owned(), element: element(i), age: None }).collect()
}
