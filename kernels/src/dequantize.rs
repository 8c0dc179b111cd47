//! Weights back from their codes, for hosts.

use crate::image::RowBlock;

/// Row `i` of the block as f32: `level * group scale * row scale`, the integers multiplied first. Fills `out` up to the
/// number of columns.
pub fn row_f32(rows: &RowBlock<'_>, i: usize, out: &mut [f32]) {
    rows.dequantize(i, out);
}
