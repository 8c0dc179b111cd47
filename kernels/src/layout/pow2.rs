//! Lengths in steps of powers of two: without a division and its panic.

/// `len` up to a multiple of `step`, a power of two.
pub(crate) const fn round_up(len: usize, step: usize) -> usize {
    (len + step - 1) & !(step - 1)
}

/// How many times `step`, a power of two, fits into `len`.
pub(crate) const fn div_down(len: usize, step: usize) -> usize {
    len >> step.trailing_zeros()
}

/// How many times `step`, a power of two, covers `len`.
pub(crate) const fn div_up(len: usize, step: usize) -> usize {
    (len + step - 1) >> step.trailing_zeros()
}
