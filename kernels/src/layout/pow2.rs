//! Lengths in steps of powers of two, without a division and its panic.

/// Rounds `len` up to a multiple of `step`, a power of two.
pub(crate) const fn round_up(len: usize, step: usize) -> usize {
    (len + step - 1) & !(step - 1)
}

/// Divides `len` by `step`, a power of two, and rounds down.
pub(crate) const fn div_down(len: usize, step: usize) -> usize {
    len >> step.trailing_zeros()
}

/// Divides `len` by `step`, a power of two, and rounds up.
pub(crate) const fn div_up(len: usize, step: usize) -> usize {
    (len + step - 1) >> step.trailing_zeros()
}
