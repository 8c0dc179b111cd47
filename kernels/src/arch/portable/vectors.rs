//! The GEMV of the layouts for Helium, on cores without it: weight by weight.

use crate::arch::product::Product;
use crate::layout::{Format, QUAD, STRIP};

/// Units that are taken together.
const VECTOR: usize = 4;

/// Computes a product as [`crate::arch::gemv`] does.
#[inline(never)]
pub(super) fn gemv<F: Format>(Product { block, x, first_row, acc, .. }: Product<'_>) {
    let shape = block.shape();
    let strips = block.words().get(first_row / QUAD * block.quad_words()..).unwrap_or(&[]);
    for (words, acc) in strips.chunks(F::STRIP / QUAD * block.quad_words()).zip(acc.chunks_mut(F::STRIP)) {
        let mut words = words;
        acc.fill(0);
        for (group, x) in x.groups().enumerate() {
            let first = group * shape.units_per_group();
            let units = shape.units_per_group().min(shape.units().saturating_sub(first));
            let (weights, rest) = words.split_at((units * F::CELL.words * acc.len() / F::CELL.rows).min(words.len()));
            let mut sums = [0; STRIP];
            let sums = sums.get_mut(..acc.len()).unwrap_or(&mut []);
            strip::<F>(weights, x.get(F::X.start_words..).unwrap_or(&[]), sums);
            let (scales, rest) =
                rest.split_at(if !shape.has_groups() { 0 } else { (acc.len() / QUAD).min(rest.len()) });
            for (i, (acc, sum)) in acc.iter_mut().zip(&*sums).enumerate() {
                let scale = scales.get(i / QUAD).map_or(1, |word| u32::from_le(*word) >> (8 * (i % QUAD)) & 0xff);
                *acc = acc.wrapping_add(sum.wrapping_mul(scale as i32));
            }
            words = rest;
        }
    }
}

/// Adds the products of whole vectors to the sums of a strip's rows.
#[inline(always)]
fn strip<F: Format>(weights: &[u32], x: &[u32], sums: &mut [i32]) {
    let cells = sums.len() / F::CELL.rows;
    for (weights, x) in weights.chunks_exact(VECTOR * F::CELL.words * cells).zip(x.chunks_exact(F::CELL.cols)) {
        for (cell, sums) in sums.chunks_exact_mut(F::CELL.rows).enumerate() {
            for (unit, x) in x.chunks_exact(F::CELL.cols / VECTOR).enumerate() {
                let word = |k: usize| match k < F::CELL.words {
                    true => weights.get((k * cells + cell) * VECTOR + unit).map_or(0, |word| u32::from_le(*word)),
                    false => 0,
                };
                let words = [word(0), word(1), word(2)];
                for (col, x) in x.iter().flat_map(|x| x.to_le_bytes()).enumerate() {
                    for (row, sum) in sums.iter_mut().enumerate() {
                        let level = F::WIDTH.level(F::extract(words, row, col));
                        *sum = sum.wrapping_add(level.wrapping_mul(i32::from(x as i8)));
                    }
                }
            }
        }
    }
}
