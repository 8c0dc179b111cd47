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

/// `true` on cores with layouts of their own: there, other cores' layouts are slow and take little code. A strip's cells
/// are computed one by one, and groups of 32 columns as all groups.
const SMALL: bool = cfg!(all(actq_loops, feature = "scalar"));

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
    in_strips::<F>(product);
}

/// Computes a product strip by strip. In a small build it is not inlined, so that it adds nothing to the stack of the core's
/// own layouts.
#[cfg_attr(all(actq_loops, feature = "scalar"), inline(never))]
fn in_strips<F: Format>(Product { block, x, first_row, acc, .. }: Product<'_>) {
    let shape = block.shape();
    let group = x.groups().next().unwrap_or(&[]);
    let first_chunk = x.chunks(split(group, group.len().wrapping_sub(usize::from(F::X.sum))).0).next().unwrap_or(&[]);
    let lengths = Lengths {
        x_group: group.len().max(1),
        first_chunk: first_chunk.len(),
        quad_group: shape.units_per_group() * F::CELL.words * (QUAD / F::CELL.rows),
        quad_scales: usize::from(shape.has_groups()),
    };
    // Whole groups of 32 columns, the usual ones, have a kernel in which all lengths are constants.
    let thirty_two = (!SMALL || F::X.pairs)
        && shape.has_groups()
        && shape.group == 32
        && shape.units() == shape.groups() * shape.units_per_group();
    let mut words = block.rows_from(first_row);
    for acc in acc.chunks_mut(F::STRIP) {
        let (strip, rest) = split(words, acc.len() / QUAD * block.quad_words());
        words = rest;
        let cells = acc.len() / F::CELL.rows;
        if SMALL {
            for (first, acc) in acc.chunks_mut(F::CELL.rows).enumerate() {
                match thirty_two {
                    false => cells_of::<F, 1>(Strip { words: strip, cells, first }, x.words(), lengths, acc),
                    true => cells_of_32::<F, 1>(Strip { words: strip, cells, first }, x.words(), acc),
                }
            }
            continue;
        }
        let strip = Strip { words: strip, cells, first: 0 };
        match (cells, thirty_two) {
            (1, false) => cells_of::<F, 1>(strip, x.words(), lengths, acc),
            (2, false) => cells_of::<F, 2>(strip, x.words(), lengths, acc),
            (_, false) => cells_of::<F, 4>(strip, x.words(), lengths, acc),
            (1, true) => cells_of_32::<F, 1>(strip, x.words(), acc),
            (2, true) => cells_of_32::<F, 2>(strip, x.words(), acc),
            (_, true) => cells_of_32::<F, 4>(strip, x.words(), acc),
        }
    }
}

/// Cells of a strip, one above the other.
#[derive(Clone, Copy)]
struct Strip<'a> {
    words: &'a [u32],
    /// Cells of the strip.
    cells: usize,
    /// The first of those to compute.
    first: usize,
}

impl Strip<'_> {
    /// Returns the strip for a function that computes `N` cells: all of them, unless it is [`SMALL`]. Then their number is a
    /// constant, so that their sums are in registers.
    #[inline(always)]
    fn of<const N: usize>(self) -> Self {
        if SMALL { self } else { Self { cells: N, first: 0, ..self } }
    }

    /// Returns the words of four rows' scales, if there are scales.
    #[inline(always)]
    fn quads<F: Format>(&self) -> usize {
        self.cells * F::CELL.rows / QUAD
    }
}

/// Splits words at `at`, without the panic of `split_at`.
#[inline(always)]
fn split(words: &[u32], at: usize) -> (&[u32], &[u32]) {
    words.split_at_checked(at).unwrap_or((words, &[]))
}

/// Computes `N` cells of a strip.
#[inline(never)]
fn cells_of<F: Format, const N: usize>(strip: Strip<'_>, mut x: &[u32], lengths: Lengths, acc: &mut [i32]) {
    let strip = strip.of::<N>();
    let quads = strip.quads::<F>();
    let scales = lengths.quad_scales * quads;
    let weights_and_scales = lengths.quad_group * quads + scales;
    let mut words = strip.words;
    let mut totals = [[0i32; QUAD]; N];
    while !x.is_empty() {
        let (group, rest) = split(x, lengths.x_group);
        x = rest;
        let (weights, rest) = split(words, weights_and_scales);
        words = rest;
        let (mut weights, scales) = split(weights, weights.len().wrapping_sub(scales));
        let (mut group, x_sum) = split(group, group.len().wrapping_sub(usize::from(F::X.sum)));
        let mut sums = [[0i32; QUAD]; N];
        let length = F::X.start_words + F::X.chunk / 2;
        if F::X.chunk == XLayout::ALL {
            chunk::<F, N>(Strip { words: weights, ..strip }, group, F::PASS, &mut sums);
        } else {
            // All chunks except the first have a constant length.
            if lengths.first_chunk != length {
                let (x, rest) = split(group, lengths.first_chunk);
                let (now, rest_weights) = split(weights, weights_of::<F>(x.len()) * strip.cells);
                chunk::<F, N>(Strip { words: now, ..strip }, x, F::PASS, &mut sums);
                (group, weights) = (rest, rest_weights);
            }
            if !group.is_empty() {
                // In a last group, the weights may end inside a chunk.
                let weights = weights.chunks((weights_of::<F>(length) * strip.cells).max(1));
                for (weights, x) in weights.zip(group.chunks_exact(length.max(1))) {
                    chunk::<F, N>(Strip { words: weights, ..strip }, x, F::PASS, &mut sums);
                }
            }
        }
        // A group's sum, which only a small build has here, is in both halves of its word.
        let halves = SMALL && lengths.quad_scales > 0;
        let x_sum = x_sum.first().map_or(0, |sum| if halves { *sum as i16 as i32 } else { *sum as i32 });
        scale::<F, N>(sums, strip.first, |quad| scale_word(scales, quad), x_sum, &mut totals);
    }
    store::<F, N>(&totals, acc);
}

/// Computes cells as [`cells_of`] does, for whole groups of 32 columns.
#[inline(never)]
fn cells_of_32<F: Format, const N: usize>(strip: Strip<'_>, x: &[u32], acc: &mut [i32]) {
    let strip = strip.of::<N>();
    if F::X.pairs {
        return cells_of_pairs::<F, N>(strip, x, acc);
    }
    let cols = if F::X.chunk < COLS { F::X.chunk } else { COLS };
    let length = F::X.start_words + cols / 2;
    let weights = weights_of::<F>(length) * strip.cells;
    let chunks = COLS / cols;
    let pass = if F::CELL.cols < 16 && cols > 8 { 2 } else { 1 };
    let mut totals = [[0i32; QUAD]; N];
    let words = strip.words.chunks_exact((chunks * weights + strip.quads::<F>()).max(1));
    for (words, x) in words.zip(x.chunks_exact(chunks * length + usize::from(F::X.sum))) {
        let mut sums = [[0i32; QUAD]; N];
        for k in 0..chunks {
            let now = Strip { words: &words[k * weights..][..weights], ..strip };
            chunk::<F, N>(now, &x[k * length..][..length], pass, &mut sums);
        }
        let x_sum = x.get(chunks * length).map_or(0, |halves| *halves as i16 as i32);
        let scales = &words[chunks * weights..];
        scale::<F, N>(sums, strip.first, |quad| scale_word(scales, quad), x_sum, &mut totals);
    }
    store::<F, N>(&totals, acc);
}

/// Computes cells as [`cells_of`] does, for layouts that pair groups; a group is a column chunk.
#[inline(always)]
fn cells_of_pairs<F: Format, const N: usize>(strip: Strip<'_>, x: &[u32], acc: &mut [i32]) {
    let length = F::X.start_words + COLS / 2;
    let weights = weights_of::<F>(length) * strip.cells;
    let quads = strip.quads::<F>();
    let mut words = strip.words;
    let mut totals = [[0i32; QUAD]; N];
    for x in x.chunks_exact(2 * length + 1) {
        let together = quads == 2 && words.len() >= 2 * (weights + quads);
        let (both, rest) = split(words, 2 * (weights + quads));
        words = rest;
        for k in 0..2 {
            let (at, scales_at) =
                if together { (weights, 2 * weights) } else { (weights + quads, k * quads + (k + 1) * weights) };
            let (Some(now), Some(scales)) = (both.get(k * at..k * at + weights), both.get(scales_at..)) else { break };
            let mut sums = [[0i32; QUAD]; N];
            chunk::<F, N>(Strip { words: now, ..strip }, &x[k * length..][..length], 2, &mut sums);
            // Rows 2i and 2i + 1 of both groups share a word.
            let half = |i: usize| scale_word(scales, i) >> (16 * k) & 0xffff;
            let of_quad = |quad| match together {
                true => half(2 * quad) | half(2 * quad + 1) << 16,
                false => scale_word(scales, quad),
            };
            let x_sum = (x[2 * length] >> (16 * k)) as i16 as i32;
            scale::<F, N>(sums, strip.first, of_quad, x_sum, &mut totals);
        }
    }
    store::<F, N>(&totals, acc);
}

/// Returns the scales of four rows; ones without group scales.
#[inline(always)]
fn scale_word(scales: &[u32], quad: usize) -> u32 {
    scales.get(quad).map_or(0x0101_0101, |word| u32::from_le(*word))
}

/// Adds the sums of a group, times its scales, to those of the cells, from the strip's cell `first` on.
#[inline(always)]
fn scale<F: Format, const N: usize>(
    mut sums: [[i32; QUAD]; N],
    first: usize,
    scales: impl Fn(usize) -> u32,
    x_sum: i32,
    totals: &mut [[i32; QUAD]; N],
) {
    if F::X.sum {
        for sums in &mut sums {
            for sum in sums.iter_mut().skip(1).step_by(2) {
                *sum = sum.wrapping_add(x_sum);
            }
        }
    }
    for (i, (totals, sums)) in totals.iter_mut().zip(&sums).enumerate() {
        // A cell's rows share a word of scales.
        let row = (first + i) * F::CELL.rows;
        let scales = scales(row / QUAD) >> (8 * (row % QUAD));
        for (r, (total, sum)) in totals.iter_mut().zip(sums).enumerate().take(F::CELL.rows) {
            *total = total.wrapping_add(sum.wrapping_mul((scales >> (8 * r) & 0xff) as i32));
        }
    }
}

/// Writes the cells' sums.
#[inline(always)]
fn store<F: Format, const N: usize>(totals: &[[i32; QUAD]; N], acc: &mut [i32]) {
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

/// Adds a chunk's products. The words of `strip` are the chunk's.
#[inline(always)]
fn chunk<F: Format, const N: usize>(strip: Strip<'_>, x: &[u32], pass: usize, sums: &mut [[i32; QUAD]; N]) {
    let (starts, x) = split(x, F::X.start_words);
    let mut t = [F::start(starts); N];
    // Long cells have registers for no more than two.
    if F::CELL.cols == 32 && N > 1 {
        if let [a, b] = t.as_chunks_mut::<2>().0 {
            // In this order the compiler spills fewer registers.
            cells::<F, 2>(Strip { first: strip.first + 2, ..strip }, x, pass, b);
            cells::<F, 2>(strip, x, pass, a);
        }
    } else {
        cells::<F, N>(strip, x, pass, &mut t);
    }
    // Weights may end before the zeros that fill up the activations.
    let units = strip.words.len() / (F::CELL.words * strip.cells).max(1);
    for (t, sums) in t.iter().zip(sums) {
        F::finish(t, units * F::CELL.cols, &mut sums[..F::CELL.rows]);
    }
}

/// Adds the products of `N` of a strip's cells.
#[inline(always)]
fn cells<F: Format, const N: usize>(strip: Strip<'_>, x: &[u32], pass: usize, t: &mut [Sums; N]) {
    let unit = F::CELL.words * strip.cells;
    let units = strip.words.chunks_exact((pass * unit).max(1));
    for (units, x) in units.zip(x.chunks_exact((pass * F::CELL.cols / 2).max(1))) {
        for k in 0..pass {
            let (words, x) = (units.get(k * unit..).unwrap_or(&[]), &x[k * F::CELL.cols / 2..][..F::CELL.cols / 2]);
            for (i, t) in t.iter_mut().enumerate() {
                let word = |k| match words.get(k * strip.cells + strip.first + i) {
                    Some(word) if k < F::CELL.words => u32::from_le(*word),
                    _ => 0,
                };
                F::mac(&[word(0), word(1), word(2)], x, t);
            }
        }
    }
}
