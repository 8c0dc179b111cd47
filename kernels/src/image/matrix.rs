//! Matrices: their records and their blocks' records, to read and to write, and the data that these name.

use super::header::{BLOCK_WORDS, MATRIX_WORDS, MAX_ROWS};
use super::words::{Records, high, low, record, rest_from, section};
use super::words::{TooLarge, halves};
use crate::error::ImageError;
use crate::layout::half::{bf16, half_word};
use crate::layout::{Block, BlockShape, Lanes, Width, is_group};

/// The record of a matrix.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MatrixRecord {
    /// Length of the output.
    pub rows: usize,
    /// Length of the input.
    pub cols: usize,
    /// Columns per u8 scale; 0 = row scales only.
    pub group: usize,
    /// Largest quantized activation.
    pub x_max: u16,
    /// The block records.
    pub blocks: Records,
}

impl MatrixRecord {
    /// Reads a record; refuses values that no matrix has.
    #[inline(always)]
    pub fn parse(record: &[u32; MATRIX_WORDS]) -> Result<Self, ImageError> {
        let [size, levels, blocks, offset] = record.map(u32::from_le);
        let (rows, cols, group, x_max) = (low(size), high(size), low(levels), high(levels) as u16);
        if rows == 0 || rows > MAX_ROWS || cols == 0 {
            return Err(ImageError::Shape);
        }
        if !is_group(group) {
            return Err(ImageError::Group);
        }
        if !cfg!(feature = "groups") && group != 0 {
            return Err(ImageError::LeftOut);
        }
        if x_max == 0 || x_max > i16::MAX as u16 {
            return Err(ImageError::Constant);
        }
        if high(blocks) != 0 {
            return Err(ImageError::Reserved);
        }
        Ok(Self { rows, cols, group, x_max, blocks: Records { offset, count: low(blocks) } })
    }

    /// Returns the record's words.
    ///
    /// # Errors
    ///
    /// [`TooLarge`] if a size does not fit its field.
    pub fn emit(&self) -> Result<[u32; MATRIX_WORDS], TooLarge> {
        let Self { rows, cols, group, x_max, blocks } = *self;
        Ok([halves(rows, cols)?, halves(group, x_max.into())?, halves(blocks.count, 0)?, blocks.offset])
    }
}

/// The record of a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockRecord {
    /// Code width.
    pub width: Width,
    /// Weights in each lane.
    pub lanes: Lanes,
    /// Rows.
    pub rows: usize,
    /// Offset of the packed weights.
    pub weights: u32,
    /// Offset of the row scales.
    pub scales: u32,
    /// Offset of the output steps, or 0.
    pub steps: u32,
}

impl BlockRecord {
    /// Reads a record of a matrix with activations up to `x_max` and these lanes, by the DSP extension; refuses values
    /// that no block of it has.
    #[inline(always)]
    pub fn parse(record: &[u32; BLOCK_WORDS], lanes: Lanes, x_max: u16) -> Result<Self, ImageError> {
        let [head, weights, scales, steps] = record.map(u32::from_le);
        #[cfg(feature = "scalar")]
        let lanes = match Lanes::from_code((head >> 8) as u8) {
            Some(Lanes::Scalar) if x_max <= Lanes::PAIRED_X_MAX => Lanes::Scalar,
            _ => lanes,
        };
        #[cfg(feature = "helium")]
        let lanes = match Lanes::from_code((head >> 8) as u8) {
            Some(Lanes::Helium) if x_max <= Lanes::PAIRED_X_MAX => Lanes::Helium,
            _ => lanes,
        };
        #[cfg(not(any(feature = "scalar", feature = "helium")))]
        let _ = x_max;
        let width = Width::from_bits(head & 0xff).ok_or(ImageError::Width)?;
        if !width.is_built() || !lanes.is_built() {
            return Err(ImageError::LeftOut);
        }
        if (head >> 8) as u8 != lanes.code() {
            return Err(ImageError::Lanes);
        }
        Ok(Self { width, lanes, rows: high(head), weights, scales, steps })
    }

    /// Returns the record's words.
    ///
    /// # Errors
    ///
    /// [`TooLarge`] if a size does not fit its field.
    pub fn emit(&self) -> Result<[u32; BLOCK_WORDS], TooLarge> {
        let head = self.width.bits() | u32::from(self.lanes.code()) << 8;
        Ok([halves(head as usize, self.rows)?, self.weights, self.scales, self.steps])
    }
}

/// A matrix in an image: blocks of rows and a bias.
#[derive(Clone, Copy, Debug)]
pub struct Matrix<'a> {
    /// Length of the output.
    pub rows: usize,
    /// Length of the input.
    pub cols: usize,
    /// Columns per u8 scale; 0 = row scales only.
    pub group: usize,
    /// Largest quantized activation: 127 for int8, up to 32767 for int16.
    pub x_max: u16,
    /// Bits of the f32 biases in the order of the output, or empty.
    pub(crate) bias: &'a [u32],
    /// The image's words, which the block records point into.
    pub(super) image: &'a [u32],
    /// The block records.
    pub(crate) records: &'a [u32],
}

/// Rows of one width with their scales and outputs.
#[derive(Clone, Copy, Debug)]
pub struct RowBlock<'a> {
    /// The packed codes.
    pub block: Block<'a>,
    /// bf16 row scales, two a word.
    pub scales: &'a [u32],
    /// Output steps, four u8 a word: from the previous row's output (at first from output 0) to each row's own. Empty
    /// if the rows follow each other from `first_row` on.
    pub steps: &'a [u32],
    /// The output of the first row; 0 with output steps, which start from it.
    pub first_row: usize,
}

impl<'a> RowBlock<'a> {
    /// Returns the row scale of the block's row `i`.
    #[inline(always)]
    pub fn scale(&self, i: usize) -> f32 {
        bf16(half_word(self.scales, i))
    }

    /// Dequantizes the block's row `i` to `level * group scale * row scale`, with the integers multiplied first. It
    /// fills `out` up to the number of columns.
    pub fn dequantize(&self, i: usize, out: &mut [f32]) {
        let scale = self.scale(i);
        for (col, out) in out.iter_mut().enumerate().take(self.block.shape().cols) {
            *out = (self.block.level(i, col) * i32::from(self.block.group_scale(i, col))) as f32 * scale;
        }
    }

    /// Iterates over the outputs of the block's rows, in order.
    pub fn outputs(&self) -> impl Iterator<Item = usize> + use<'a> {
        let steps = bytemuck::must_cast_slice::<u32, u8>(self.steps);
        let mut next = self.first_row;
        (0..self.block.shape().rows).map(move |i| {
            let output = next + steps.get(i).map_or(0, |step| usize::from(*step));
            next = output + usize::from(steps.is_empty());
            output
        })
    }
}

impl<'a> Matrix<'a> {
    /// Returns the lanes of the matrix's blocks in the DSP extension's layouts.
    pub const fn lanes(&self) -> Lanes {
        Lanes::of(self.x_max, self.group)
    }

    /// Iterates over the blocks in the order of the image.
    pub fn blocks(&self) -> impl Iterator<Item = RowBlock<'a>> + use<'a> {
        let matrix = *self;
        let mut first_row = 0;
        self.records.as_chunks().0.iter().filter_map(move |record| {
            let rows = row_block(&matrix, record, first_row).ok()?;
            first_row += rows.block.shape().rows;
            Some(rows)
        })
    }

    /// Returns the bytes of everything that describes the weights ([`block_bytes`]), without biases and matrix record.
    pub fn weight_bytes(&self) -> usize {
        self.blocks().map(|rows| block_bytes(rows.block.shape(), !rows.steps.is_empty())).sum()
    }

    /// Returns the bias of output `row`; 0 if the matrix has none.
    pub fn bias(&self, row: usize) -> f32 {
        self.bias.get(row).map_or(0.0, |w| f32::from_bits(u32::from_le(*w)))
    }

    /// Returns `true` if the matrix has biases: a product that accumulates adds those that it has.
    pub fn has_bias(&self) -> bool {
        !self.bias.is_empty()
    }

    /// Returns the bits of the biases if the output starts from them and every row is written once, in order.
    pub fn start_values(&self, accumulate: bool) -> Option<&[u32]> {
        if accumulate || self.bias.is_empty() || !self.is_whole() { None } else { Some(self.bias) }
    }

    /// Returns the number of blocks.
    pub(crate) fn block_count(&self) -> usize {
        self.records.len() / BLOCK_WORDS
    }

    /// Returns `true` if the blocks hold all rows in the order of the output.
    fn is_whole(&self) -> bool {
        let mut rows = 0;
        let (records, _) = self.records.as_chunks::<BLOCK_WORDS>();
        records.iter().all(|[head, _, _, steps]| {
            rows += (u32::from_le(*head) >> 16) as usize;
            *steps == 0
        }) && rows == self.rows
    }
}

/// Reads the matrix of the record at `at` with the biases at `bias` (0: none); refuses an impossible record.
pub(super) fn matrix(image: &[u32], at: usize, bias: usize) -> Result<Matrix<'_>, ImageError> {
    let MatrixRecord { rows, cols, group, x_max, blocks } = MatrixRecord::parse(record(image, at)?)?;
    let section = |offset, len| section(image, offset, len).ok_or(ImageError::Section);
    let bias = if bias == 0 { &[] } else { section(bias, rows)? };
    let records = section(blocks.offset as usize, blocks.count * BLOCK_WORDS)?;
    Ok(Matrix { rows, cols, group, x_max, bias, image, records })
}

/// Reads the block of a record; refuses an impossible record.
#[inline(never)]
pub(crate) fn row_block<'a>(
    matrix: &Matrix<'a>,
    record: &[u32; BLOCK_WORDS],
    first_row: usize,
) -> Result<RowBlock<'a>, ImageError> {
    let record = BlockRecord::parse(record, matrix.lanes(), matrix.x_max)?;
    let BlockRecord { width, lanes, rows, weights, scales, steps } = record;
    let shape = BlockShape { width, lanes, rows, cols: matrix.cols, group: matrix.group };
    if !shape.is_valid() || rows > matrix.rows {
        return Err(ImageError::Shape);
    }
    let words = |offset: u32, len| section(matrix.image, offset as usize, len).ok_or(ImageError::Section);
    let scales = words(scales, rows.div_ceil(2))?;
    let (steps, first_row) = if steps == 0 { (&[][..], first_row) } else { (words(steps, rows.div_ceil(4))?, 0) };
    match Block::leading(shape, rest_from(matrix.image, weights as usize)) {
        Some(block) => Ok(RowBlock { block, scales, steps, first_row }),
        None => Err(ImageError::Section),
    }
}

/// Returns the bytes of a block: packed words with their padding and group scales, row scales, output steps if the
/// block is `stepped`, and the block record.
pub const fn block_bytes(shape: BlockShape, stepped: bool) -> usize {
    let steps = if stepped { shape.rows.div_ceil(4) } else { 0 };
    4 * (shape.words() + shape.rows.div_ceil(2) + steps + BLOCK_WORDS)
}

/// Packs u16 values two a word, as the image holds row scales.
pub fn half_words(values: &[u16]) -> impl Iterator<Item = u32> + '_ {
    values.chunks(2).map(|pair| pair.iter().rev().fold(0u32, |word, v| word << 16 | u32::from(*v)))
}

/// Packs u8 values four a word, as the image holds output steps.
pub fn quarter_words(values: &[u8]) -> impl Iterator<Item = u32> + '_ {
    values.chunks(4).map(|four| four.iter().rev().fold(0u32, |word, v| word << 8 | u32::from(*v)))
}
