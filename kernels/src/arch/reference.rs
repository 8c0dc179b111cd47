//! The plain GEMV: decodes one weight at a time by the packer's inverse. Slow, and what the others are compared with.

use super::product::Product;
use crate::layout::Block;
use crate::x::Prepared;

/// The value that a GEMV computes for `row`: `sum over groups of scale * sum over columns of level * x`, modulo 2^32.
pub fn dot(block: &Block<'_>, x: &Prepared<'_>, row: usize) -> i32 {
    (0..block.shape().cols).fold(0i32, |sum, col| {
        let weight = block.level(row, col) * i32::from(block.group_scale(row, col));
        sum.wrapping_add(weight.wrapping_mul(i32::from(x.value(col))))
    })
}

/// As [`crate::arch::gemv`].
pub fn gemv(Product { block, x, first_row, acc }: Product<'_>) {
    for (row, sum) in (first_row..).zip(acc) {
        *sum = if row < block.shape().rows { dot(block, x, row) } else { 0 };
    }
}
