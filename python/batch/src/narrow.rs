//! The integer sums of rows whose weights have at most 4 bits, by AVX2's products of bytes.
//!
//! Two products of bytes are added in 16 bits, and several such pairs fit there: an instruction multiplies twice as many
//! weights as in [`crate::product`], and a group scale multiplies a sum in place of every weight. One operand of the
//! instruction has no sign: the heads' values, plus [`OFFSET`]. The sums start without its share.

use actq_kernels::image::RowBlock;
use fearless_simd::{Level, prelude::*};
#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
use fearless_simd::{i8x32, i16x16, i32x8};

#[cfg(target_arch = "x86")]
use core::arch::x86::*;
#[cfg(target_arch = "x86_64")]
use core::arch::x86_64::*;

#[cfg(any(test, target_arch = "x86", target_arch = "x86_64"))]
use crate::product::HEADS;
use crate::product::ROWS;

/// The offset of the heads' values, so that none is negative.
pub(crate) const OFFSET: u8 = 128;
/// Columns whose products a register adds to one sum of 32 bits.
const QUAD: usize = 4;
/// Rows of a register.
const LANES: usize = 8;
/// Registers for [`ROWS`] sums.
const REGISTERS: usize = ROWS / LANES;
/// Most bits of a weight.
const MAX_BITS: u32 = 4;
/// Largest magnitude of a head's value.
const MAX_X: u16 = 127;

/// Rows with at most [`MAX_BITS`] bits.
#[derive(Debug)]
pub(crate) struct Narrow {
    /// Quads of columns.
    quads: usize,
    /// Most quads of a run: columns of one group whose sums fit in 16 bits.
    run: usize,
    /// For each [`ROWS`] rows, for each quad.
    levels: Vec<Levels>,
    /// For each [`ROWS`] rows, for each run: the group scale of each row, twice.
    scales: Vec<[[i16; LANES * 2]; REGISTERS]>,
    /// For each [`ROWS`] rows: minus their sums of a vector of [`OFFSET`]s.
    starts: Vec<[[i32; LANES]; REGISTERS]>,
}

/// A quad of levels of each of [`ROWS`] rows, which no load finds in two cache lines.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Levels([[i8; LANES * QUAD]; REGISTERS]);

impl Narrow {
    /// Returns `true` if this module multiplies a vector of values up to `x_max` on the level.
    pub(crate) fn is_for(level: Level, x_max: u16) -> bool {
        x_max <= MAX_X && multiplies_bytes(level)
    }

    /// Returns `true` if the rows of a block are narrow enough.
    pub(crate) fn has_room_for(rows: &RowBlock<'_>) -> bool {
        rows.block.shape().width.bits() <= MAX_BITS
    }

    /// Unpacks rows: blocks, and indices of rows in them. All have the same columns and groups.
    pub(crate) fn new<'b>(rows: impl ExactSizeIterator<Item = (RowBlock<'b>, usize)> + Clone) -> Self {
        let shape = |(rows, _): (RowBlock<'b>, usize)| rows.block.shape();
        let bits = rows.clone().map(|row| shape(row).width.bits()).max().unwrap_or(1);
        let [cols, group] = rows.clone().map(shape).next().map_or([0; 2], |shape| [shape.cols, shape.group]);
        let (quads, run) = (cols.div_ceil(QUAD), run(bits, group / QUAD));
        let (tiles, runs) = (rows.len().div_ceil(ROWS), quads.div_ceil(run));
        let mut levels = vec![Levels([[0; LANES * QUAD]; REGISTERS]); tiles * quads];
        let mut scales = vec![[[0; LANES * 2]; REGISTERS]; tiles * runs];
        let mut starts = vec![[[0i32; LANES]; REGISTERS]; tiles];
        for (at, (rows, i)) in rows.enumerate() {
            let (tile, register, lane) = (at / ROWS, at % ROWS / LANES, at % LANES);
            let start = &mut starts[tile][register][lane];
            for col in 0..cols {
                let (level, scale) = (rows.block.level(i, col), rows.block.group_scale(i, col));
                levels[tile * quads + col / QUAD].0[register][lane * QUAD + col % QUAD] = level as i8;
                scales[tile * runs + col / QUAD / run][register][lane * 2..][..2].fill(scale.into());
                *start = start.wrapping_sub(level * i32::from(scale) * i32::from(OFFSET));
            }
        }
        Self { quads, run, levels, scales, starts }
    }

    /// Returns the quads of a vector.
    pub(crate) fn quads(&self) -> usize {
        self.quads
    }

    /// Computes the sums of all rows for all heads, in the first of the `blocks` sums of each head. `x` has the quads of
    /// values of each head, with [`OFFSET`], as bytes in the order of memory; heads are a multiple of [`HEADS`].
    #[inline(always)]
    pub(crate) fn product<S: Simd>(&self, simd: S, x: &[u32], sums: &mut [[i32; ROWS]], blocks: usize) {
        #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
        if let Some(avx2) = simd.level().as_avx2() {
            return product(avx2, self, x, sums, blocks);
        }
        let _ = simd;
        self.product_portably(x, sums, blocks);
    }

    /// Does the same as [`Self::product`], product by product.
    fn product_portably(&self, x: &[u32], sums: &mut [[i32; ROWS]], blocks: usize) {
        let runs = self.quads.div_ceil(self.run);
        for (sums, x) in sums.chunks_exact_mut(blocks).zip(x.chunks_exact(self.quads)) {
            let x: &[u8] = bytemuck::must_cast_slice(x);
            for (tile, (sums, start)) in sums.iter_mut().zip(&self.starts).enumerate() {
                for (row, sum) in sums.iter_mut().enumerate() {
                    let (register, lane) = (row / LANES, row % LANES);
                    *sum = start[register][lane];
                    for (col, x) in x.iter().enumerate() {
                        let quad = col / QUAD;
                        let level = self.levels[tile * self.quads + quad].0[register][lane * QUAD + col % QUAD];
                        let scale = self.scales[tile * runs + quad / self.run][register][lane * 2];
                        *sum = sum.wrapping_add(i32::from(level) * i32::from(*x) * i32::from(scale));
                    }
                }
            }
        }
    }
}

#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
fn multiplies_bytes(level: Level) -> bool {
    level.as_avx2().is_some()
}

#[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
fn multiplies_bytes(_: Level) -> bool {
    false
}

/// Returns the most quads whose sums fit in 16 bits and that divide a group, if there is one.
fn run(bits: u32, group: usize) -> usize {
    // Two columns of a quad share a sum.
    let quad = 2 * i32::from(u8::MAX) * ((1 << bits) - 1);
    let most = (i32::from(i16::MAX) / quad) as usize;
    (1..=most).rev().find(|run| group.is_multiple_of(*run)).unwrap_or(1)
}

fearless_simd::kernel!(
    fn product(avx2: Avx2, narrow: &Narrow, x: &[u32], sums: &mut [[i32; ROWS]], blocks: usize) {
        let Narrow { quads, run, levels, scales, starts } = narrow;
        let tiles = levels.chunks_exact(*quads).zip(scales.chunks_exact(quads.div_ceil(*run))).zip(starts);
        for (tile, ((levels, scales), start)) in tiles.enumerate() {
            let start: [__m256i; REGISTERS] =
                [i32x8::from_slice(avx2, &start[0]).into(), i32x8::from_slice(avx2, &start[1]).into()];
            for (sums, x) in sums.chunks_exact_mut(HEADS * blocks).zip(x.chunks_exact(HEADS * quads)) {
                let mut totals = [start; HEADS];
                let (x0, x) = x.split_at(*quads);
                let (x1, x) = x.split_at(*quads);
                let (x2, x3) = x.split_at(*quads);
                let x = x0.chunks(*run).zip(x1.chunks(*run)).zip(x2.chunks(*run)).zip(x3.chunks(*run));
                for ((levels, scales), (((x0, x1), x2), x3)) in levels.chunks(*run).zip(scales).zip(x) {
                    let mut partial = [[_mm256_setzero_si256(); REGISTERS]; HEADS];
                    for ((((levels, x0), x1), x2), x3) in levels.iter().zip(x0).zip(x1).zip(x2).zip(x3) {
                        for (partial, x) in partial.iter_mut().zip([x0, x1, x2, x3]) {
                            let x = _mm256_set1_epi32(*x as i32);
                            for (partial, levels) in partial.iter_mut().zip(&levels.0) {
                                let levels = i8x32::from_slice(avx2, levels).into();
                                *partial = _mm256_add_epi16(*partial, _mm256_maddubs_epi16(x, levels));
                            }
                        }
                    }
                    for (totals, partial) in totals.iter_mut().zip(partial) {
                        for ((total, partial), scales) in totals.iter_mut().zip(partial).zip(scales) {
                            let scales = i16x16::from_slice(avx2, scales).into();
                            *total = _mm256_add_epi32(*total, _mm256_madd_epi16(partial, scales));
                        }
                    }
                }
                for (sums, totals) in sums[tile..].iter_mut().step_by(blocks).zip(totals) {
                    for (sums, total) in sums.chunks_exact_mut(LANES).zip(totals) {
                        let total: i32x8<_> = total.simd_into(avx2);
                        total.store_slice(sums);
                    }
                }
            }
        }
    }
);

#[cfg(test)]
mod tests {
    use actq::random::Random;
    use fearless_simd::dispatch;

    use super::*;

    #[test]
    fn extreme_values_have_the_sums_of_single_products() {
        const HEADS_HERE: usize = 2 * HEADS;
        let level = Level::new();
        let mut random = Random::new(1);
        let shapes = (2..=MAX_BITS).flat_map(|bits| [0usize, 32, 64, 128].map(|group| (bits, group)));
        let shapes = shapes.flat_map(|shape| [1usize, 31, 32, 127, 300].map(|cols| (shape, cols)));
        for ((bits, group), cols) in shapes {
            let (quads, run, largest) = (cols.div_ceil(QUAD), run(bits, group / QUAD), (1 << bits) - 1);
            assert!((group / QUAD).is_multiple_of(run), "{bits} bits, groups of {group}");
            let mut either = |values: [i32; 2]| values[random.below(2)];
            let narrow = Narrow {
                quads,
                run,
                levels: vec![Levels([[either([-largest, largest]) as i8; LANES * QUAD]; REGISTERS]); 3 * quads],
                scales: vec![[[255; LANES * 2]; REGISTERS]; 3 * quads.div_ceil(run)],
                starts: vec![[[either([i32::MIN, i32::MAX]); LANES]; REGISTERS]; 3],
            };
            // Of one sign, the sums are as large as can be.
            let all = vec![either([0x0101_0101, -1]) as u32; HEADS_HERE * quads];
            let some: Vec<u32> = (0..all.len()).map(|_| either([0x01ff_01ff, 0x7f01_ff80]) as u32).collect();
            for x in [all, some] {
                let [mut expected, mut sums] = [0, 1].map(|i| vec![[i; ROWS]; HEADS_HERE * 4]);
                narrow.product_portably(&x, &mut expected, 4);
                dispatch!(level, simd => narrow.product(simd, &x, &mut sums, 4));
                for (head, (expected, sums)) in expected.chunks(4).zip(sums.chunks(4)).enumerate() {
                    assert_eq!(expected[..3], sums[..3], "{bits} bits, groups of {group}, {cols} columns, head {head}");
                }
            }
        }
    }
}
