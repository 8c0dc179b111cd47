//! The reference GEMV: it decodes one weight at a time by the packer's inverse. It is slow; tests compare the others
//! with it.

use super::product::Product;
use crate::activations::Prepared;
use crate::layout::Block;

/// Computes a GEMV's value for `row`: `sum over groups of scale * sum over columns of level * x`, modulo 2^32.
pub fn dot(block: &Block<'_>, x: &Prepared<'_>, row: usize) -> i32 {
    (0..block.shape().cols).fold(0i32, |sum, col| {
        let weight = block.level(row, col) * i32::from(block.group_scale(row, col));
        sum.wrapping_add(weight.wrapping_mul(i32::from(x.value(col))))
    })
}

/// Computes a product as [`crate::arch::gemv`] does.
pub fn gemv(Product { block, x, first_row, acc, .. }: Product<'_>) {
    for (row, sum) in (first_row..).zip(acc) {
        *sum = if row < block.shape().rows { dot(block, x, row) } else { 0 };
    }
}
