//! Syntax of operations in policy.json. Each operation reads its own keys, in its file in [`super::ops`].

use crate::error::{Context, Result};

/// An op of policy.json that becomes an operation of type `T`.
#[derive(Clone, Copy, Debug)]
pub struct Syntax<T> {
    /// Value of the key `op`.
    pub name: &'static str,
    /// Keys beside `op`, `input` and `save`.
    pub keys: &'static [&'static str],
    /// Reads the operation.
    pub read: fn(&mut dyn Keys) -> Result<T>,
}

/// The keys of an op, and what their values name. A key is `None` if it is absent or null. Another type than the
/// expected one is an error.
pub trait Keys {
    /// Returns the op's name.
    fn op(&self) -> &str;

    /// Returns the length of the op's input.
    fn input_len(&self) -> usize;

    /// Returns a text.
    fn text(&self, key: &str) -> Result<Option<&str>>;

    /// Returns a number.
    fn number(&self, key: &str) -> Result<Option<f64>>;

    /// Returns a number that is not negative and has no fraction.
    fn count(&self, key: &str) -> Result<Option<usize>>;

    /// Returns `true` or `false`.
    fn truth(&self, key: &str) -> Result<Option<bool>>;

    /// Reads the tensor that the key names, which has `len` values.
    fn vector(&self, key: &str, len: usize) -> Result<Option<Vec<f32>>>;

    /// Reads the tensor that the key names as a matrix of `cols` columns, and of `rows` rows, if given. Returns its
    /// index in the graph's matrices and its rows.
    fn matrix(&mut self, key: &str, rows: Option<usize>, cols: usize) -> Result<(usize, usize)>;

    /// Appends the value that the key names to the inputs of the operation.
    fn add_input(&mut self, key: &str) -> Result<()>;

    /// Appends the next `len` values of the prefix to the inputs of the operation.
    fn add_prefix(&mut self, len: usize) -> Result<()>;

    /// Reads the tensor that the key names, or returns zeros.
    fn bias(&self, key: &str, len: usize) -> Result<Vec<f32>> {
        Ok(self.vector(key, len)?.unwrap_or_else(|| vec![0.0; len]))
    }
}

/// Returns the value of a key that must be present.
pub fn required<T>(value: Option<T>, key: &str) -> Result<T> {
    value.with_context(|| format!("the key {key:?} is missing"))
}
