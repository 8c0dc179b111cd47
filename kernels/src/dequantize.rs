//! Weights back from their codes, for hosts.

use crate::image::RowBlock;

/// Row `i` of the block as f32: `level * group scale * row scale`, the integers multiplied first. Fills `out` up to the
/// number of columns.
pub fn row_f32(rows: &RowBlock<'_>, i: usize, out: &mut [f32]) {
    let scale = rows.scale(i);
    for (col, out) in out.iter_mut().enumerate().take(rows.block.shape().cols) {
        *out = (rows.block.level(i, col) * i32::from(rows.block.group_scale(i, col))) as f32 * scale;
    }
}
