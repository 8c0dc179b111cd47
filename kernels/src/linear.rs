//! A quantized matrix times a vector, from f32 to f32: the order of operations that every machine follows.
//!
//! 1. `x` is quantized to integers `q` with one scale ([`crate::activations::quantize`]).
//! 2. Per row, the integer sum `acc = sum_g s_g * sum_c level * q` in int32 ([`crate::gemv`]).
//! 3. `y = start + acc * (row_scale * x_scale)`, each operation rounded to f32, where `start` is the bias, or, where the
//!    operation accumulates, the sum of the old `y` and the bias. Rows that no block holds (0 bits) keep `start`.

use crate::activations::{self, NotFinite, Prepared};
use crate::format::{Block, QUAD};
use crate::gemv::gemv;

/// Quads whose sums stand on the stack at once.
const CHUNK: usize = 8;

/// A matrix in an image: blocks of rows and a bias.
#[derive(Clone, Copy, Debug)]
pub struct Matrix<'a> {
    /// Length of the output.
    pub rows: usize,
    /// Length of the input.
    pub cols: usize,
    /// Columns per u8 scale; 0 = row scales only.
    pub group: usize,
    /// Magnitude that the activations are quantized to: 127 for int8, up to 32767 for int16.
    pub x_max: u16,
    /// Bits of the f32 biases in the order of the output, or empty.
    pub(crate) bias: &'a [u32],
    /// The image's words, which the block records point into.
    pub(crate) image: &'a [u32],
    /// The block records.
    pub(crate) records: &'a [u32],
}

/// Rows of one width with their scales and places in the output.
#[derive(Clone, Copy, Debug)]
pub struct RowBlock<'a> {
    /// The packed codes.
    pub block: Block<'a>,
    /// bf16 row scales, two a word.
    pub(crate) scales: &'a [u32],
    /// u16 output indexes, two a word; empty where the rows follow each other from `first_row` on.
    pub(crate) index: &'a [u32],
    pub(crate) first_row: usize,
}

/// Half `i` of a run of packed u16.
#[inline(always)]
pub(crate) fn half_word(words: &[u32], i: usize) -> u16 {
    let word = words.get(i / 2).copied().unwrap_or(0);
    (u32::from_le(word) >> (16 * (i % 2))) as u16
}

impl RowBlock<'_> {
    /// The scale of the block's row `i`.
    #[inline(always)]
    pub fn scale(&self, i: usize) -> f32 {
        // bf16 is the upper half of f32.
        f32::from_bits((half_word(self.scales, i) as u32) << 16)
    }

    /// The output index of the block's row `i`.
    #[inline(always)]
    pub fn output(&self, i: usize) -> usize {
        if self.index.is_empty() { self.first_row + i } else { half_word(self.index, i) as usize }
    }
}

impl Matrix<'_> {
    /// Words that the prepared activations take.
    pub fn prepared_words(&self) -> usize {
        activations::prepared_words(self.cols, self.group)
    }

    /// `y = W x + b`, or `y = y + b + W x` where `accumulate`. `work` holds at least [`Self::prepared_words`] words; `x` and
    /// `y` have the matrix's lengths (what is missing is left out).
    pub fn apply(&self, x: &[f32], work: &mut [u32], y: &mut [f32], accumulate: bool) -> Result<(), NotFinite> {
        let Some(work) = work.get_mut(..self.prepared_words()) else { return Ok(()) };
        let x_scale = activations::quantize(x, self.x_max, self.group, work)?;
        self.start(y, accumulate);
        let Some(x) = Prepared::new(work, self.cols, self.group) else { return Ok(()) };
        for rows in self.blocks() {
            let mut quad = 0;
            let quads = rows.block.shape().quads();
            while quad < quads {
                let mut acc = [[0i32; QUAD]; CHUNK];
                if gemv(&rows.block, &x, quad, &mut acc).is_err() {
                    return Ok(());
                }
                let first = quad * QUAD;
                let count = (rows.block.shape().rows - first).min(CHUNK * QUAD);
                for (i, acc) in acc.as_flattened().iter().enumerate().take(count) {
                    if let Some(y) = y.get_mut(rows.output(first + i)) {
                        *y += *acc as f32 * (rows.scale(first + i) * x_scale);
                    }
                }
                quad += CHUNK;
            }
        }
        Ok(())
    }

    fn start(&self, y: &mut [f32], accumulate: bool) {
        if !accumulate {
            y.fill(0.0);
        }
        for (y, &bias) in y.iter_mut().zip(self.bias) {
            let bias = f32::from_bits(u32::from_le(bias));
            *y = if accumulate { *y + bias } else { bias };
        }
    }
}

/// The largest magnitude that an int32 sum of the block's rows can reach for activations up to `x_max`: the largest row sum of
/// `|level| * scale`, times `x_max`. Exact, and so linear in the number of weights.
pub fn worst_case(block: &Block<'_>, x_max: u16) -> i64 {
    let shape = block.shape();
    let row_sum = |row| -> i64 {
        (0..shape.cols)
            .map(|col| i64::from(block.level(row, col).unsigned_abs()) * i64::from(block.group_scale(row, col)))
            .sum()
    };
    (0..shape.rows).map(row_sum).max().unwrap_or(0) * i64::from(x_max)
}

/// An upper bound of [`worst_case`] from the shape alone.
pub fn worst_case_bound(block: &Block<'_>, x_max: u16) -> i64 {
    let shape = block.shape();
    let scale = if shape.group == 0 { 1 } else { 255 };
    shape.cols as i64 * i64::from(shape.width.max_level()) * scale * i64::from(x_max)
}
