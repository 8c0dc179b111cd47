//! The GEMV in plain Rust, for any target: the arithmetic of the assembler backend, sum for sum.
//!
//! The loops suit a compiler that has few registers and knows the layout. They process a strip's cells together, so
//! that one load of an activation serves all of them. Lengths that the layout determines are constants.

use crate::arch::product::Product;
#[cfg(any(feature = "scalar", feature = "helium"))]
use crate::layout::Kernel;
use crate::layout::{Format, QUAD, Sums, XLayout, with_format};

/// Computes a product as [`crate::arch::gemv`] does.
pub fn gemv(product: Product<'_>) {
    with_format!(product.block.shape(), strips::<_>(product));
}

/// Columns of the usual groups.
const COLS: usize = 32;

/// Lengths in words.
#[derive(Clone, Copy)]
struct Lengths {
    /// A group of the vector with its sum.
    x_group: usize,
    /// The first chunk of a group.
    first_chunk: usize,
    /// Weights of a group in four rows.
    quad_group: usize,
    /// Scales of a group in four rows: 1 or 0.
    quad_scales: usize,
}

fn strips<F: Format>(product: Product<'_>) {
    #[cfg(feature = "scalar")]
    match F::KERNEL {
        Kernel::Planes => return super::planes::gemv::<F>(product),
        Kernel::Pairs => return super::pairs::gemv(product),
        Kernel::Bytes => return super::bytes::gemv(product),
        Kernel::Strips | Kernel::Vectors => {}
    }
    #[cfg(feature = "helium")]
    if F::KERNEL == Kernel::Vectors {
        return super::vectors::gemv::<F>(product);
    }
    let Product { block, x, first_row, acc, .. } = product;
    let shape = block.shape();
    let group = x.groups().next().unwrap_or(&[]);
    let first_chunk = x.chunks(split(group, group.len().wrapping_sub(usize::from(F::X.sum))).0).next().unwrap_or(&[]);
    let lengths = Lengths {
        x_group: group.len().max(1),
        first_chunk: first_chunk.len(),
        quad_group: shape.units_per_group() * F::CELL.words * (QUAD / F::CELL.rows),
        quad_scales: usize::from(shape.group != 0),
    };
    // Whole groups of 32 columns, the usual ones, have a kernel in which all lengths are constants.
    let thirty_two = shape.group == 32 && shape.units() == shape.groups() * shape.units_per_group();
    let mut words = block.rows_from(first_row);
    for acc in acc.chunks_mut(F::STRIP) {
        let (strip, rest) = split(words, acc.len() / QUAD * block.quad_words());
        words = rest;
        // The number of a strip's cells is a constant, so that their sums are in registers.
        match (acc.len() / F::CELL.rows, thirty_two) {
            (1, false) => strip_of::<F, 1>(strip, x.words(), lengths, acc),
            (2, false) => strip_of::<F, 2>(strip, x.words(), lengths, acc),
            (_, false) => strip_of::<F, 4>(strip, x.words(), lengths, acc),
            (1, true) => strip_of_32::<F, 1>(strip, x.words(), acc),
            (2, true) => strip_of_32::<F, 2>(strip, x.words(), acc),
            (_, true) => strip_of_32::<F, 4>(strip, x.words(), acc),
        }
    }
}

/// Splits words at `at`, without the panic of `split_at`.
#[inline(always)]
fn split(words: &[u32], at: usize) -> (&[u32], &[u32]) {
    words.split_at_checked(at).unwrap_or((words, &[]))
}

/// Computes a strip of `CELLS` cells, one above the other.
#[inline(never)]
fn strip_of<F: Format, const CELLS: usize>(mut words: &[u32], mut x: &[u32], lengths: Lengths, acc: &mut [i32]) {
    let quads = CELLS * F::CELL.rows / QUAD;
    let scales = lengths.quad_scales * quads;
    let weights_and_scales = lengths.quad_group * quads + scales;
    let mut totals = [[0i32; QUAD]; CELLS];
    while !x.is_empty() {
        let (group, rest) = split(x, lengths.x_group);
        x = rest;
        let (weights, rest) = split(words, weights_and_scales);
        words = rest;
        let (mut weights, scales) = split(weights, weights.len().wrapping_sub(scales));
        let (mut group, x_sum) = split(group, group.len().wrapping_sub(usize::from(F::X.sum)));
        let mut sums = [[0i32; QUAD]; CELLS];
        let length = F::X.start_words + F::X.chunk / 2;
        if F::X.chunk == XLayout::ALL {
            chunk::<F, CELLS>(weights, group, F::PASS, &mut sums);
        } else {
            // All chunks except the first have a constant length.
            if lengths.first_chunk != length {
                let (x, rest) = split(group, lengths.first_chunk);
                let (now, rest_weights) = split(weights, weights_of::<F>(x.len()) * CELLS);
                chunk::<F, CELLS>(now, x, F::PASS, &mut sums);
                (group, weights) = (rest, rest_weights);
            }
            if !group.is_empty() {
                // In a last group, the weights may end inside a chunk.
                let weights = weights.chunks((weights_of::<F>(length) * CELLS).max(1));
                for (weights, x) in weights.zip(group.chunks_exact(length.max(1))) {
                    chunk::<F, CELLS>(weights, x, F::PASS, &mut sums);
                }
            }
        }
        let x_sum = x_sum.first().map_or(0, |sum| *sum as i32);
        scale::<F, CELLS>(sums, |quad| scale_word(scales, quad), x_sum, &mut totals);
    }
    store::<F, CELLS>(&totals, acc);
}

/// Computes a strip as [`strip_of`] does, for whole groups of 32 columns.
#[inline(never)]
fn strip_of_32<F: Format, const CELLS: usize>(words: &[u32], x: &[u32], acc: &mut [i32]) {
    if F::X.pairs {
        return strip_of_pairs::<F, CELLS>(words, x, acc);
    }
    let cols = if F::X.chunk < COLS { F::X.chunk } else { COLS };
    let length = F::X.start_words + cols / 2;
    let weights = weights_of::<F>(length) * CELLS;
    let chunks = COLS / cols;
    let quads = CELLS * F::CELL.rows / QUAD;
    let pass = if F::CELL.cols < 16 && cols > 8 { 2 } else { 1 };
    let mut totals = [[0i32; QUAD]; CELLS];
    let words = words.chunks_exact(chunks * weights + quads);
    for (words, x) in words.zip(x.chunks_exact(chunks * length + usize::from(F::X.sum))) {
        let mut sums = [[0i32; QUAD]; CELLS];
        for k in 0..chunks {
            chunk::<F, CELLS>(&words[k * weights..][..weights], &x[k * length..][..length], pass, &mut sums);
        }
        let x_sum = x.get(chunks * length).map_or(0, |halves| *halves as i16 as i32);
        let scales = &words[chunks * weights..];
        scale::<F, CELLS>(sums, |quad| scale_word(scales, quad), x_sum, &mut totals);
    }
    store::<F, CELLS>(&totals, acc);
}

/// Computes a strip as [`strip_of_32`] does, for layouts that pair groups; a group is a column chunk.
#[inline(always)]
fn strip_of_pairs<F: Format, const CELLS: usize>(mut words: &[u32], x: &[u32], acc: &mut [i32]) {
    let length = F::X.start_words + COLS / 2;
    let weights = weights_of::<F>(length) * CELLS;
    let quads = CELLS * F::CELL.rows / QUAD;
    let mut totals = [[0i32; QUAD]; CELLS];
    for x in x.chunks_exact(2 * length + 1) {
        let together = quads == 2 && words.len() >= 2 * (weights + quads);
        let (both, rest) = split(words, 2 * (weights + quads));
        words = rest;
        for k in 0..2 {
            let (at, scales_at) =
                if together { (weights, 2 * weights) } else { (weights + quads, k * quads + (k + 1) * weights) };
            let (Some(now), Some(scales)) = (both.get(k * at..k * at + weights), both.get(scales_at..)) else { break };
            let mut sums = [[0i32; QUAD]; CELLS];
            chunk::<F, CELLS>(now, &x[k * length..][..length], 2, &mut sums);
            // Rows 2i and 2i + 1 of both groups share a word.
            let half = |i: usize| scale_word(scales, i) >> (16 * k) & 0xffff;
            let of_quad = |quad| match together {
                true => half(2 * quad) | half(2 * quad + 1) << 16,
                false => scale_word(scales, quad),
            };
            let x_sum = (x[2 * length] >> (16 * k)) as i16 as i32;
            scale::<F, CELLS>(sums, of_quad, x_sum, &mut totals);
        }
    }
    store::<F, CELLS>(&totals, acc);
}

/// Returns the scales of four rows; ones without group scales.
#[inline(always)]
fn scale_word(scales: &[u32], quad: usize) -> u32 {
    scales.get(quad).map_or(0x0101_0101, |word| u32::from_le(*word))
}

/// Adds the sums of a group, times its scales, to the strip's.
#[inline(always)]
fn scale<F: Format, const CELLS: usize>(
    mut sums: [[i32; QUAD]; CELLS],
    scales: impl Fn(usize) -> u32,
    x_sum: i32,
    totals: &mut [[i32; QUAD]; CELLS],
) {
    if F::X.sum {
        for sums in &mut sums {
            for sum in sums.iter_mut().skip(1).step_by(2) {
                *sum = sum.wrapping_add(x_sum);
            }
        }
    }
    for quad in 0..CELLS * F::CELL.rows / QUAD {
        let scale = scales(quad);
        for row in 0..QUAD {
            let (i, r) = ((QUAD * quad + row) / F::CELL.rows, (QUAD * quad + row) % F::CELL.rows);
            let scale = scale >> (8 * row) & 0xff;
            totals[i][r] = totals[i][r].wrapping_add(sums[i][r].wrapping_mul(scale as i32));
        }
    }
}

/// Writes a strip's sums.
#[inline(always)]
fn store<F: Format, const CELLS: usize>(totals: &[[i32; QUAD]; CELLS], acc: &mut [i32]) {
    for (acc, totals) in acc.chunks_exact_mut(F::CELL.rows).zip(totals) {
        for (acc, total) in acc.iter_mut().zip(totals) {
            *acc = *total;
        }
    }
}

/// Returns the words of weights in a cell's rows for a column chunk of `chunk` words.
#[inline(always)]
const fn weights_of<F: Format>(chunk: usize) -> usize {
    chunk.saturating_sub(F::X.start_words) / (F::CELL.cols / 2) * F::CELL.words
}

/// Adds a chunk's products.
#[inline(always)]
fn chunk<F: Format, const CELLS: usize>(weights: &[u32], x: &[u32], pass: usize, sums: &mut [[i32; QUAD]; CELLS]) {
    let (starts, x) = split(x, F::X.start_words);
    let mut t = [F::start(starts); CELLS];
    // Long cells have registers for no more than two.
    if F::CELL.cols == 32 {
        if let [a, b] = t.as_chunks_mut::<2>().0 {
            // In this order the compiler spills fewer registers.
            cells::<F, CELLS, 2>(weights, x, pass, 2, b);
            cells::<F, CELLS, 2>(weights, x, pass, 0, a);
        }
    } else {
        cells::<F, CELLS, CELLS>(weights, x, pass, 0, &mut t);
    }
    // Weights may end before the zeros that fill up the activations.
    let units = weights.len() / (F::CELL.words * CELLS);
    for (t, sums) in t.iter().zip(sums) {
        F::finish(t, units * F::CELL.cols, &mut sums[..F::CELL.rows]);
    }
}

/// Adds the products of `N` of a strip's `CELLS` cells, from `first` on.
#[inline(always)]
fn cells<F: Format, const CELLS: usize, const N: usize>(
    weights: &[u32],
    x: &[u32],
    pass: usize,
    first: usize,
    t: &mut [Sums; N],
) {
    let unit = F::CELL.words * CELLS;
    for (units, x) in weights.chunks_exact((pass * unit).max(1)).zip(x.chunks_exact((pass * F::CELL.cols / 2).max(1))) {
        for k in 0..pass {
            let (words, x) = (&units[k * unit..][..unit], &x[k * F::CELL.cols / 2..][..F::CELL.cols / 2]);
            for (i, t) in t.iter_mut().enumerate() {
                let word = |k| if k < F::CELL.words { u32::from_le(words[k * CELLS + first + i]) } else { 0 };
                F::mac(&[word(0), word(1), word(2)], x, t);
            }
        }
    }
}
