//! The GEMV of 8 bits without lanes: a product is those of two rows, and is separated after two columns.
//!
//! The start values of two columns are the same for all rows. They are computed for a tile of columns, next to the
//! activations, before all strips use them. Until the end, the sums of two rows are all of `t`, modulo 2^32, and
//! `t >> 16`. In the loop of ARMv6-M a product is that of one row ([`PLAIN`]).

#[cfg(actq_loops)]
use crate::arch::loops::add_bytes;
use crate::arch::product::Product;
use crate::arch::tables::{LEAST_PAIRS, TWO_COLUMNS};
use crate::layout::QUAD;
use crate::layout::half::halves;
#[cfg(not(actq_loops))]
use crate::layout::w8_scalar::MASK;

/// `true` if sums are those of `code * x`, row by row: no instruction masks and shifts, so two rows at once save nothing.
const PLAIN: bool = cfg!(actq_armv6m);

/// Two columns: their activations and, unless sums are plain, the start value `s`, and `s + 2^8 s`.
type TwoColumns = [i32; WORDS];

/// Words of two columns.
const WORDS: usize = if PLAIN { 2 } else { TWO_COLUMNS };

/// Computes a product as [`crate::arch::gemv`] does.
#[inline(never)]
pub(super) fn gemv(mut product: Product<'_>) {
    let memory = core::mem::take(&mut product.tables).words();
    match bytemuck::must_cast_slice_mut::<u32, i32>(memory).as_chunks_mut().0 {
        tile if tile.len() >= LEAST_PAIRS.min(product.block.shape().units()) => tiles(product, tile),
        _ => on_stack(product),
    }
}

/// Computes a product with a tile on the stack.
#[inline(never)]
fn on_stack(product: Product<'_>) {
    tiles(product, &mut [[0; WORDS]; LEAST_PAIRS]);
}

fn tiles(Product { block, x, first_row, acc, .. }: Product<'_>, tile: &mut [TwoColumns]) {
    let shape = block.shape();
    let (units, group) = (shape.units(), shape.units_per_group());
    let stride = block.quad_words();
    let words = block.rows_from(first_row);
    let strips = acc.as_chunks_mut::<QUAD>().0;
    let most = tile.len() & !3;
    strips.as_flattened_mut().fill(0);
    let (mut at, mut end, mut groups, mut fixed) = (0, group, 0, 0);
    while at < units {
        let len = most.min(end.min(units) - at);
        let Some(pairs) = x.words().get(at..at + len) else { return };
        tile.iter_mut().zip(pairs).for_each(|(columns, pair)| *columns = two_columns(*pair));
        let tile = tile.get(..len).unwrap_or(&[]);
        fixed = if !shape.has_groups() { fixed } else { 0 } + terms(tile);
        let weights = words.get(2 * at + groups..).unwrap_or(&[]);
        if !shape.has_groups() {
            add_bytes(weights, stride, tile, strips);
        } else {
            let scales = words.get(2 * end.min(units) + groups..).unwrap_or(&[]);
            for (i, acc) in strips.iter_mut().enumerate() {
                let mut sums = [0; QUAD];
                let weights = weights.get(i * stride..).unwrap_or(&[]);
                add_bytes(weights, stride, tile, core::slice::from_mut(&mut sums));
                separate(&mut sums, fixed);
                let scales = scales.get(i * stride).map_or([0; QUAD], |word| u32::from_le(*word).to_le_bytes());
                for ((acc, sum), scale) in acc.iter_mut().zip(sums).zip(scales) {
                    *acc = acc.wrapping_add(sum.wrapping_mul(i32::from(scale)));
                }
            }
        }
        at += len;
        if shape.has_groups() && at == end {
            (end, groups) = (end + group, groups + 1);
        }
    }
    if !shape.has_groups() {
        separate(strips.as_flattened_mut(), fixed);
    }
}

/// Returns the activations of two columns with their start values.
#[inline(always)]
fn two_columns(pair: u32) -> TwoColumns {
    let (even, odd) = halves(pair);
    let start = 0x8000i32.wrapping_sub((even + odd).wrapping_mul(128 * 0x1_0001));
    let all = [even, odd, start, start.wrapping_add(start << 8)];
    core::array::from_fn(|i| all[i])
}

/// Returns the terms that the sums of a tile contain in every row: the offsets of the codes, or the biases of the low
/// halves.
fn terms(tile: &[TwoColumns]) -> i32 {
    if PLAIN { 128 * tile.as_flattened().iter().sum::<i32>() } else { 0x8000 * tile.len() as i32 }
}

/// Separates the sums of pairs of rows, and subtracts these terms.
fn separate(rows: &mut [i32], terms: i32) {
    for [even, odd] in rows.as_chunks_mut().0 {
        let (low, high) = if PLAIN { (*even, odd.wrapping_sub(terms)) } else { (even.wrapping_sub(*odd << 16), *odd) };
        (*even, *odd) = (low.wrapping_sub(terms), high);
    }
}

/// Adds the products of a tile to the sums of strips, whose weights are `stride` words apart.
#[cfg(not(actq_loops))]
fn add_bytes(words: &[u32], stride: usize, tile: &[TwoColumns], strips: &mut [[i32; QUAD]]) {
    for (sums, words) in strips.iter_mut().zip(words.chunks(stride)) {
        let mut t = *sums;
        for ([a, b], [even, odd, start, _]) in words.as_chunks().0.iter().zip(tile) {
            let product = |word: u32, x: i32| ((word & MASK) as i32).wrapping_mul(x);
            let (a, b) = (u32::from_le(*a), u32::from_le(*b));
            let low = product(a, *even).wrapping_add(product(b, *odd)).wrapping_add(*start);
            let high = product(a >> 8, *even).wrapping_add(product(b >> 8, *odd)).wrapping_add(*start);
            for (sums, t2) in t.as_chunks_mut::<2>().0.iter_mut().zip([low, high]) {
                sums[0] = sums[0].wrapping_add(t2);
                sums[1] = sums[1].wrapping_add(t2 >> 16);
            }
        }
        *sums = t;
    }
}
