//! The GEMV in plain Rust, for any target: the arithmetic of the assembler backend, sum for sum.

use crate::activations::Prepared;
use crate::format::{Block, BlockShape, Format, QUAD, with_format};

/// As [`crate::gemv::gemv`], for lengths that were checked there.
pub fn gemv(block: &Block<'_>, x: &Prepared<'_>, first_row: usize, acc: &mut [i32]) {
    with_format!(block.shape(), strips::<_>(block, x, first_row, acc));
}

fn strips<F: Format>(block: &Block<'_>, x: &Prepared<'_>, first_row: usize, acc: &mut [i32]) {
    let mut words = block.rows_from(first_row);
    for acc in acc.chunks_mut(F::STRIP) {
        let (now, rest) = words.split_at((acc.len() / QUAD * block.quad_words()).min(words.len()));
        // The number of a strip's cells is known to the compiler, so that their sums stand in registers.
        match acc.len() / F::CELL.rows {
            1 => strip::<F, 1>(block.shape(), now, x, acc),
            2 => strip::<F, 2>(block.shape(), now, x, acc),
            _ => strip::<F, 4>(block.shape(), now, x, acc),
        }
        words = rest;
    }
}

/// A strip of `CELLS` cells, one above the other.
fn strip<F: Format, const CELLS: usize>(shape: BlockShape, mut words: &[u32], x: &Prepared<'_>, acc: &mut [i32]) {
    acc.fill(0);
    let mut units = shape.units();
    for group in x.groups() {
        let mut sums = [[0i32; QUAD]; CELLS];
        let (chunks, sum) = group.split_at(group.len() - usize::from(F::X.sum));
        for chunk in x.chunks(chunks) {
            let (starts, pairs) = chunk.split_at(F::X.starts.len());
            let mut t = [F::start(starts); CELLS];
            // With single lanes, the vector is padded further than the weights.
            let count = (pairs.len() / (F::CELL.cols / 2)).min(units);
            units -= count;
            let (now, rest) = words.split_at((count * F::CELL.words * CELLS).min(words.len()));
            words = rest;
            for (unit, pairs) in now.chunks_exact(F::CELL.words * CELLS).zip(pairs.chunks_exact(F::CELL.cols / 2)) {
                for (i, t) in t.iter_mut().enumerate() {
                    let mut cell = [0; 3];
                    for (word, words) in cell.iter_mut().zip(unit.chunks_exact(CELLS)) {
                        *word = u32::from_le(words[i]);
                    }
                    F::mac(&cell, pairs, t);
                }
            }
            for (t, sums) in t.iter().zip(&mut sums) {
                F::finish(t, &mut sums[..F::CELL.rows]);
            }
        }
        let sum = sum.first().map_or(0, |s| *s as i32);
        // A word of scales for every four rows follows the group.
        let (scales, rest) = words.split_at(if shape.group == 0 { 0 } else { acc.len() / QUAD }.min(words.len()));
        words = rest;
        for (r, (acc, sum_of_row)) in acc.iter_mut().zip(sums.iter().flat_map(|s| &s[..F::CELL.rows])).enumerate() {
            let x_sum = if r % 2 == 1 { sum } else { 0 };
            let scale = scales.get(r / QUAD).map_or(1, |word| u32::from_le(*word) >> (8 * (r % QUAD)) & 0xff);
            *acc = acc.wrapping_add(sum_of_row.wrapping_add(x_sum).wrapping_mul(scale as i32));
        }
    }
}
