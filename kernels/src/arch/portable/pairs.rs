//! The GEMV of 4 bits without lanes: a product is those of two rows.
//!
//! A chunk of columns is done for all strips before the next, so its start value is loaded once. Until the end, the sums
//! of two rows are all of `t`, modulo 2^32, and `t >> 16`.

use crate::activations::Prepared;
#[cfg(actq_loops)]
use crate::arch::loops::add_pairs;
use crate::arch::product::Product;
use crate::layout::half::halves;
use crate::layout::w4_scalar::MASK;
use crate::layout::{QUAD, STRIP};

/// Words before a chunk's pairs: the start value and the sum of x.
const STARTS: usize = 2;

/// Computes a product as [`crate::arch::gemv`] does.
#[inline(never)]
pub(super) fn gemv(Product { block, x, first_row, acc, .. }: Product<'_>) {
    let shape = block.shape();
    let stride = STRIP / QUAD * block.quad_words();
    let words = block.rows_from(first_row);
    let (strips, last) = acc.as_chunks_mut::<STRIP>();
    let mut last = last.first_chunk_mut::<QUAD>();
    let after = words.get(strips.len() * stride..).unwrap_or(&[]);
    let row = Row { x, units: shape.units(), group: shape.units_per_group() };
    if !shape.has_groups() {
        strips.as_flattened_mut().fill(0);
        last.iter_mut().for_each(|last| last.fill(0));
        let fixed = row.chunks(0, |at, chunk| {
            add_pairs(words.get(2 * at..).unwrap_or(&[]), stride, chunk, strips);
            if let Some(last) = &mut last {
                add(after.get(at..).unwrap_or(&[]), chunk, last);
            }
        });
        fixed.separate(strips.as_flattened_mut());
        last.iter_mut().for_each(|last| fixed.separate(&mut last[..]));
        return;
    }
    // Never: it tells the compiler that no division by it panics.
    if row.group == 0 {
        return;
    }
    for (acc, words) in strips.iter_mut().zip(words.chunks(stride.max(1))) {
        row.groups(words, acc, |words, chunk, sums| add_pairs(words, stride, chunk, core::slice::from_mut(sums)));
    }
    if let Some(acc) = last {
        row.groups(after, acc, add::<QUAD>);
    }
}

/// A prepared row of `units` units, `group` of them a group.
struct Row<'a> {
    x: &'a Prepared<'a>,
    units: usize,
    group: usize,
}

impl Row<'_> {
    /// Calls `work` with the number of the first unit and with each chunk of a group.
    #[inline(always)]
    fn chunks(&self, group: usize, mut work: impl FnMut(usize, &[u32])) -> Fixed {
        let (mut at, mut fixed) = (group * self.group, Fixed::default());
        for chunk in self.x.groups().nth(group).into_iter().flat_map(|group| self.x.chunks(group)) {
            // Zeros fill the last group of the activations, and not of the weights.
            let len = STARTS + self.units.saturating_sub(at);
            let chunk = chunk.get(..len).unwrap_or(chunk);
            let [_, sum, pairs @ ..] = chunk else { break };
            if pairs.is_empty() {
                break;
            }
            work(at, chunk);
            fixed.biases = fixed.biases.wrapping_add(0x8000);
            fixed.sum = fixed.sum.wrapping_add(*sum as i32);
            at += pairs.len();
        }
        fixed
    }

    /// Computes the sums of a strip of `R` rows group by group.
    #[inline(always)]
    fn groups<const R: usize>(
        &self,
        words: &[u32],
        acc: &mut [i32; R],
        mut add: impl FnMut(&[u32], &[u32], &mut [i32; R]),
    ) {
        let quads = R / QUAD;
        acc.fill(0);
        for group in 0..self.units.div_ceil(self.group) {
            let mut sums = [0; R];
            let fixed = self.chunks(group, |at, chunk| {
                add(words.get((at + group) * quads..).unwrap_or(&[]), chunk, &mut sums);
            });
            fixed.separate(&mut sums);
            let end = self.units.min((group + 1) * self.group);
            let scales: &[u8] = bytemuck::must_cast_slice(words.get((end + group) * quads..).unwrap_or(&[]));
            for ((acc, sum), scale) in acc.iter_mut().zip(sums).zip(scales) {
                *acc = acc.wrapping_add(sum.wrapping_mul(i32::from(*scale)));
            }
        }
    }
}

/// Terms that the sums of all rows contain.
#[derive(Clone, Copy, Default)]
struct Fixed {
    /// Biases of the low halves.
    biases: i32,
    /// The sum of x.
    sum: i32,
}

impl Fixed {
    /// Separates the sums of pairs of rows.
    fn separate(self, rows: &mut [i32]) {
        for [even, odd] in rows.as_chunks_mut().0 {
            let low = even.wrapping_sub(*odd << 16).wrapping_sub(self.biases);
            *even = low.wrapping_mul(2).wrapping_add(self.sum);
            *odd = odd.wrapping_mul(2).wrapping_add(self.sum);
        }
    }
}

/// Adds a chunk's products to the sums of `R` rows, which are not separated.
#[inline(always)]
fn add<const R: usize>(words: &[u32], chunk: &[u32], sums: &mut [i32; R]) {
    let [start, _, pairs @ ..] = chunk else { return };
    let mut t = [[*start as i32; 2]; STRIP / QUAD];
    for (unit, pair) in words.chunks_exact(R / QUAD).zip(pairs) {
        let (even, odd) = halves(*pair);
        for (word, t) in unit.iter().zip(&mut t) {
            let word = u32::from_le(*word);
            let product = |shift: u32, x: i32| ((word >> shift & MASK) as i32).wrapping_mul(x);
            t[0] = t[0].wrapping_add(product(0, even)).wrapping_add(product(8, odd));
            t[1] = t[1].wrapping_add(product(4, even)).wrapping_add(product(12, odd));
        }
    }
    for ([total, high], t) in sums.as_chunks_mut().0.iter_mut().zip(t.as_flattened()) {
        *total = total.wrapping_add(*t);
        *high = high.wrapping_add(t >> 16);
    }
}

/// Adds a chunk's products to the sums of strips, whose weights are `stride` words apart.
#[cfg(not(actq_loops))]
fn add_pairs(words: &[u32], stride: usize, chunk: &[u32], strips: &mut [[i32; STRIP]]) {
    strips.iter_mut().zip(words.chunks(stride.max(1))).for_each(|(sums, words)| add(words, chunk, sums));
}
