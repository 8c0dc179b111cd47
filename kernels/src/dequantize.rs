//! Weights back from their codes, for hosts and for targets that compute in another number format.

use half::f16;

use crate::linear::RowBlock;

/// Row `i` of the block as f32: `level * group scale * row scale`, the integers multiplied first. Fills `out` up to the
/// number of columns.
pub fn row_f32(rows: &RowBlock<'_>, i: usize, out: &mut [f32]) {
    let scale = rows.scale(i);
    for (col, out) in out.iter_mut().enumerate().take(rows.block.shape().cols) {
        *out = integer(rows, i, col) as f32 * scale;
    }
}

/// As [`row_f32`], rounded to f16 (half to even). Values beyond 65504 become infinite.
pub fn row_f16(rows: &RowBlock<'_>, i: usize, out: &mut [f16]) {
    let scale = rows.scale(i);
    for (col, out) in out.iter_mut().enumerate().take(rows.block.shape().cols) {
        *out = f16::from_f32(integer(rows, i, col) as f32 * scale);
    }
}

/// Row `i` of the block as integers, `level * group scale`, to be multiplied with the row scale. At most 15 * 255 for the
/// narrow widths; at 8 bits with group scales the product is at most 128 * 255 = 32640, so i16 always holds it.
pub fn row_i16(rows: &RowBlock<'_>, i: usize, out: &mut [i16]) {
    for (col, out) in out.iter_mut().enumerate().take(rows.block.shape().cols) {
        *out = integer(rows, i, col) as i16;
    }
}

fn integer(rows: &RowBlock<'_>, i: usize, col: usize) -> i32 {
    rows.block.level(i, col) * i32::from(rows.block.group_scale(i, col))
}
