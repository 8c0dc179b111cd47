//! The GEMV in plain Rust, for any target: the arithmetic of the assembler backend, sum for sum.

use crate::activations::Prepared;
use crate::format::{Block, Format, QUAD, with_format};

/// As [`crate::gemv::gemv`], for lengths that were checked there.
pub fn gemv(block: &Block<'_>, x: &Prepared<'_>, first_row: usize, acc: &mut [i32]) {
    with_format!(block.shape(), gemv_of::<_>(block, x, first_row, acc));
}

fn gemv_of<F: Format>(block: &Block<'_>, x: &Prepared<'_>, first_row: usize, acc: &mut [i32]) {
    let shape = block.shape();
    let last_row = shape.padded_rows();
    for (first, acc) in (first_row..last_row).step_by(F::CELL.rows).zip(acc.chunks_exact_mut(F::CELL.rows)) {
        acc.fill(0);
        let mut unit = 0;
        for (group, words) in x.groups().enumerate() {
            let mut sums = [0i32; QUAD];
            let (chunks, sum) = words.split_at(words.len() - usize::from(F::X.sum));
            for chunk in x.chunks(chunks) {
                let (starts, pairs) = chunk.split_at(F::X.starts.len());
                let mut t = F::start(starts);
                for pairs in pairs.chunks_exact(F::CELL.cols / 2).take(shape.units() - unit) {
                    F::mac(&block.cell(first, unit), pairs, &mut t);
                    unit += 1;
                }
                F::finish(&t, &mut sums[..F::CELL.rows]);
            }
            for (r, (acc, sum_of_row)) in acc.iter_mut().zip(sums).enumerate() {
                let x_sum = if r % 2 == 1 { sum.first().map_or(0, |s| *s as i32) } else { 0 };
                let scale = i32::from(block.group_scale(first + r, group * shape.group));
                *acc = acc.wrapping_add(sum_of_row.wrapping_add(x_sum).wrapping_mul(scale));
            }
        }
    }
}
