//! The integer sums of a product for several heads: the sums of [`actq_kernels::arch::gemv`], modulo 2^32.
//!
//! The values of a vector register are sums of successive rows: it adds the products of two columns of these rows with
//! a head's values of both columns, which all rows share. So no sum is spread over a register.

use core::ops::Range;

use fearless_simd::prelude::*;

/// Rows whose sums are in registers together; a multiple of every register's values.
pub(crate) const ROWS: usize = 16;
/// Heads whose sums are in registers together.
pub(crate) const HEADS: usize = 4;
/// Most registers for [`ROWS`] sums.
const REGISTERS: usize = 4;

/// The weights of two columns, times their group scales: both columns of a row, then those of the next row.
pub(crate) type Weights = [i16; 2 * ROWS];

/// Computes the sums of the rows of `blocks` for all heads. `weights` has the pairs of columns of each [`ROWS`] rows. `x`
/// has the pairs of values of each head, as i16 in the order of memory; heads are a multiple of [`HEADS`]. The sums of a
/// head follow those of the previous head; they end with these blocks.
#[inline(always)]
pub(crate) fn product<S: Simd>(
    simd: S,
    pairs: usize,
    weights: &[Weights],
    x: &[i32],
    sums: &mut [[i32; ROWS]],
    blocks: Range<usize>,
) {
    let of_head = blocks.end;
    for (block, weights) in blocks.zip(weights.chunks_exact(pairs)) {
        for (sums, x) in sums.chunks_exact_mut(HEADS * of_head).zip(x.chunks_exact(HEADS * pairs)) {
            let mut registers = [[S::i32s::splat(simd, 0); REGISTERS]; HEADS];
            add(simd, weights, x, &mut registers);
            for (sums, registers) in sums[block..].iter_mut().step_by(of_head).zip(registers) {
                for (sums, register) in sums.chunks_exact_mut(S::i32s::LEN).zip(registers) {
                    register.store_slice(sums);
                }
            }
        }
    }
}

/// Adds the products of some rows with the values of [`HEADS`] heads.
#[inline(always)]
fn add<S: Simd>(simd: S, weights: &[Weights], x: &[i32], sums: &mut [[S::i32s; REGISTERS]; HEADS]) {
    let (a, x) = x.split_at(weights.len());
    let (b, x) = x.split_at(weights.len());
    let (c, x) = x.split_at(weights.len());
    let (d, _) = x.split_at(weights.len());
    for ((((weights, a), b), c), d) in weights.iter().zip(a).zip(b).zip(c).zip(d) {
        for (sums, x) in sums.iter_mut().zip([a, b, c, d]) {
            let x: S::i16s = S::i32s::splat(simd, *x).bitcast();
            for (sum, weights) in sums.iter_mut().zip(weights.chunks_exact(S::i16s::LEN)) {
                *sum += S::i16s::from_slice(simd, weights).pairwise_dot_product(x);
            }
        }
    }
}
