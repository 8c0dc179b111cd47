//! The integer sums of a product for several heads: the sums of [`actq_kernels::arch::gemv`], modulo 2^32.

use fearless_simd::prelude::*;

/// Columns that a step multiplies: a multiple of every vector's length.
pub(crate) const COLS: usize = 32;
/// Rows whose sums are in registers together.
pub(crate) const ROWS: usize = 4;
/// Heads whose sums are in registers together.
pub(crate) const HEADS: usize = 2;

/// Columns of as many rows as are multiplied together: weights times group scales.
pub(crate) type Weights = [[i16; COLS]; ROWS];
/// Columns of as many heads as are multiplied together: quantized activations.
pub(crate) type Activations = [[i16; COLS]; HEADS];

/// Computes the sums of all rows for all heads. `weights` has `steps` for each [`ROWS`] rows, `x` has `steps` for each
/// [`HEADS`] heads. The sums of a head follow those of the previous head.
#[inline(always)]
pub(crate) fn product<S: Simd>(
    simd: S,
    steps: usize,
    weights: &[Weights],
    x: &[Activations],
    sums: &mut [[i32; ROWS]],
) {
    let blocks = weights.len() / steps;
    for (block, weights) in weights.chunks_exact(steps).enumerate() {
        for (sums, x) in sums.chunks_exact_mut(HEADS * blocks).zip(x.chunks_exact(steps)) {
            let all = sums_of(simd, weights, x);
            for (sums, of_head) in sums[block..].iter_mut().step_by(blocks).zip(all) {
                *sums = of_head;
            }
        }
    }
}

/// Computes the sums of some rows for some heads. It has no closures: they would be compiled without the level's
/// instructions where they are not inlined.
#[inline(always)]
fn sums_of<S: Simd>(simd: S, weights: &[Weights], x: &[Activations]) -> [[i32; ROWS]; HEADS] {
    let mut partial = [[S::i32s::splat(simd, 0); ROWS]; HEADS];
    for (weights, x) in weights.iter().zip(x) {
        for at in (0..COLS).step_by(S::i16s::LEN) {
            for (partial, x) in partial.iter_mut().zip(x) {
                let x = S::i16s::from_slice(simd, &x[at..at + S::i16s::LEN]);
                for (partial, weights) in partial.iter_mut().zip(weights) {
                    let weights = S::i16s::from_slice(simd, &weights[at..at + S::i16s::LEN]);
                    *partial += weights.pairwise_dot_product(x);
                }
            }
        }
    }
    let mut sums = [[0; ROWS]; HEADS];
    for (sums, partial) in sums.iter_mut().zip(partial) {
        for (sum, partial) in sums.iter_mut().zip(partial) {
            *sum = partial.reduce_sum();
        }
    }
    sums
}
