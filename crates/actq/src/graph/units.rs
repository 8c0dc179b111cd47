//! Rows of an operation that belong to some of its units.

/// Returns the rows of a matrix or bias, of `rows`, that belong to some of an operation's `hidden` units. Of a
/// recurrent cell, the rows of the first gate come first, then those of the second, and so on.
pub(crate) fn unit_rows(rows: usize, hidden: usize, units: &[usize]) -> Vec<usize> {
    (0..rows / hidden.max(1)).flat_map(|gate| units.iter().map(move |unit| gate * hidden + unit)).collect()
}

/// Keeps the values of some units of a vector.
pub(super) fn keep(vector: &mut Vec<f32>, hidden: usize, units: &[usize]) {
    *vector = unit_rows(vector.len(), hidden, units).into_iter().map(|row| vector[row]).collect();
}
