//! A linear operation for several heads: its matrix in the form that [`product`] multiplies, and the work for each head
//! before and after, in the order of operations of `actq-kernels`' `ops/linear.rs`.
//!
//! Functions that are compiled for a level have no closures that the standard library calls: those would be compiled
//! without the level's instructions if they are not inlined.

use actq_kernels::StepError;
use actq_kernels::activations::Scale;
use actq_kernels::image::{Op, OpKind, Region, RowBlock};
use actq_kernels::round::ROUND;
use fearless_simd::{Level, prelude::*};

use crate::narrow::{Narrow, OFFSET};
use crate::product::{HEADS, ROWS, Weights, product};

/// A linear operation.
#[derive(Debug)]
pub(crate) struct Linear {
    pub(crate) src: Region,
    dst: Region,
    x_max: u16,
    accumulate: bool,
    /// The biases, or zeros if outputs start without; empty if they keep their values.
    biases: Vec<f32>,
    /// Pairs of columns.
    pairs: usize,
    /// The first rows in the order of `scales`, if they are narrow.
    narrow: Option<Narrow>,
    /// Blocks of [`ROWS`] rows in `narrow`.
    narrow_blocks: usize,
    /// Weights of the other rows.
    weights: Vec<Weights>,
    /// Scales of the rows that have weights.
    scales: Vec<f32>,
    /// Outputs of these rows, unless they are all outputs in order.
    outputs: Option<Vec<usize>>,
}

/// Vectors of several heads, and their sums.
#[derive(Debug, Default)]
pub(crate) struct Operands {
    /// Pairs of integers, for rows that are not narrow.
    x: Vec<i32>,
    /// Quads of integers, for narrow rows.
    quads: Vec<u32>,
    sums: Vec<[i32; ROWS]>,
    /// Scales of the vectors.
    scales: Vec<f32>,
}

impl Linear {
    /// Unpacks the matrix of an operation for a level; `None` if the operation is not linear.
    pub(crate) fn new(level: Level, op: &Op<'_>) -> Option<Self> {
        let (OpKind::Linear { accumulate, .. }, Some(matrix)) = (op.kind, op.matrix()) else { return None };
        let of_block = |block| {
            let outputs = RowBlock::outputs(&block).enumerate();
            outputs.map(move |(i, output)| (output, block, i))
        };
        let mut rows: Vec<(usize, RowBlock<'_>, usize)> = matrix.blocks().flat_map(of_block).collect();
        // The order of sums does not matter, except of those of one output, which stay in the image's order.
        rows.sort_by_key(|(output, ..)| *output);
        let is_narrow = |rows: &RowBlock<'_>| Narrow::is_for(level, matrix.x_max) && Narrow::has_room_for(rows);
        if rows.is_sorted_by(|(before, ..), (output, ..)| before < output) {
            rows.sort_by_key(|(_, rows, _)| !is_narrow(rows));
        }
        // Rows are multiplied in blocks. One with both kinds of rows is not narrow.
        let narrow = rows.iter().take_while(|(_, rows, _)| is_narrow(rows)).count();
        let narrow = if narrow < rows.len() { narrow - narrow % ROWS } else { narrow };
        let (narrow, wide) = rows.split_at(narrow);
        let pairs = matrix.cols.div_ceil(2);
        let mut weights = vec![[0; 2 * ROWS]; wide.len().div_ceil(ROWS) * pairs];
        for (at, (_, rows, i)) in wide.iter().enumerate() {
            let weights = &mut weights[at / ROWS * pairs..][..pairs];
            for col in 0..matrix.cols {
                // A level is in -128 ..= 127 and a scale at most 255, so that the product fits.
                let weight = rows.block.level(*i, col) * i32::from(rows.block.group_scale(*i, col));
                weights[col / 2][at % ROWS * 2 + col % 2] = weight as i16;
            }
        }
        let narrow_blocks = narrow.len().div_ceil(ROWS);
        let narrow = narrow.iter().map(|(_, rows, i)| (*rows, *i));
        let narrow = (narrow_blocks > 0).then(|| Narrow::new(narrow));
        let outputs: Vec<usize> = rows.iter().map(|(output, ..)| *output).collect();
        let is_whole = outputs.iter().copied().eq(0..matrix.rows);
        let has_start = !accumulate || matrix.has_bias();
        Some(Self {
            src: op.src(),
            dst: op.dst(),
            x_max: matrix.x_max,
            accumulate,
            biases: (0..matrix.rows).filter(|_| has_start).map(|row| matrix.bias(row)).collect(),
            pairs,
            narrow,
            narrow_blocks,
            weights,
            scales: rows.iter().map(|(_, rows, i)| rows.scale(*i)).collect(),
            outputs: (!is_whole).then_some(outputs),
        })
    }

    /// Returns the blocks of [`ROWS`] rows.
    fn blocks(&self) -> usize {
        self.scales.len().div_ceil(ROWS)
    }

    /// Prepares for the vectors of up to `heads` heads.
    pub(crate) fn begin(&self, operands: &mut Operands, heads: usize) {
        let heads = heads.next_multiple_of(HEADS);
        let Operands { x, quads, sums, scales } = operands;
        if !self.weights.is_empty() {
            x.resize(x.len().max(heads * self.pairs), 0);
        }
        if let Some(narrow) = &self.narrow {
            quads.resize(quads.len().max(heads * narrow.quads()), 0);
        }
        sums.resize(sums.len().max(heads * self.blocks()), [0; ROWS]);
        scales.clear();
    }

    /// Quantizes the vector of the next head.
    ///
    /// # Errors
    ///
    /// [`StepError::NotFinite`] if a value is NaN or infinite. Then it is not among the vectors.
    #[inline(always)]
    pub(crate) fn quantize<S: Simd>(&self, simd: S, operands: &mut Operands, x: &[u32]) -> Result<(), StepError> {
        let mut magnitude = 0;
        for bits in x {
            magnitude = magnitude.max(bits & 0x7fff_ffff);
        }
        let scale = Scale::of_magnitude(magnitude, self.x_max).map_err(|_| StepError::NotFinite)?;
        let (inverse, vector) = (scale.inverse(), operands.scales.len());
        let x = bytemuck::must_cast_slice(x);
        if !self.weights.is_empty() {
            let pairs = &mut operands.x[vector * self.pairs..][..self.pairs];
            integers(simd, inverse, x, bytemuck::must_cast_slice_mut(pairs));
        }
        if let Some(narrow) = &self.narrow {
            let quads = &mut operands.quads[vector * narrow.quads()..][..narrow.quads()];
            bytes(simd, inverse, x, bytemuck::must_cast_slice_mut(quads));
        }
        operands.scales.push(scale.get());
        Ok(())
    }

    /// Computes the sums of all vectors.
    #[inline(always)]
    pub(crate) fn multiply<S: Simd>(&self, simd: S, operands: &mut Operands) {
        let heads = operands.scales.len().next_multiple_of(HEADS);
        let blocks = self.blocks();
        let sums = &mut operands.sums[..heads * blocks];
        if let Some(narrow) = &self.narrow {
            narrow.product(simd, &operands.quads[..heads * narrow.quads()], sums, blocks);
        }
        if !self.weights.is_empty() {
            let x = &operands.x[..heads * self.pairs];
            product(simd, self.pairs, &self.weights, x, sums, self.narrow_blocks..blocks);
        }
    }

    /// Computes the outputs of the head with this vector, in its arena.
    #[inline(always)]
    pub(crate) fn scale_back<S: Simd>(&self, _: S, operands: &Operands, vector: usize, arena: &mut [u32]) {
        let sums = operands.sums[vector * self.blocks()..][..self.blocks()].as_flattened();
        let x_scale = operands.scales[vector];
        let y: &mut [f32] = bytemuck::must_cast_slice_mut(&mut arena[self.dst.range()]);
        let rows = sums.iter().zip(&self.scales);
        if self.outputs.is_none() && !self.accumulate {
            for ((y, bias), (sum, scale)) in y.iter_mut().zip(&self.biases).zip(rows) {
                *y = bias + *sum as f32 * (scale * x_scale);
            }
            return;
        }
        if self.accumulate {
            for (y, bias) in y.iter_mut().zip(&self.biases) {
                *y += bias;
            }
        } else {
            y.copy_from_slice(&self.biases);
        }
        if let Some(outputs) = &self.outputs {
            for (output, (sum, scale)) in outputs.iter().zip(rows) {
                y[*output] += *sum as f32 * (scale * x_scale);
            }
        } else {
            for (y, (sum, scale)) in y.iter_mut().zip(rows) {
                *y += *sum as f32 * (scale * x_scale);
            }
        }
    }
}

/// Converts values to integers, by the rule of [`actq_kernels::round`]. One more integer keeps its value: its weights
/// are 0.
#[inline(always)]
fn integers<S: Simd>(simd: S, inverse: f32, values: &[f32], to: &mut [i16]) {
    let to = &mut to[..values.len()];
    let (mut some, mut some_to) = (values.chunks_exact(S::i16s::LEN), to.chunks_exact_mut(S::i16s::LEN));
    for (values, to) in (&mut some).zip(&mut some_to) {
        let (low, high) = values.split_at(S::f32s::LEN);
        let low: S::i32s = (S::f32s::from_slice(simd, low) * inverse + ROUND).bitcast();
        let high: S::i32s = (S::f32s::from_slice(simd, high) * inverse + ROUND).bitcast();
        low.narrow(high).store_slice(to);
    }
    for (value, to) in some.remainder().iter().zip(some_to.into_remainder()) {
        *to = (value * inverse + ROUND).to_bits() as i16;
    }
}

/// Converts values to integers as [`integers`] does, and adds [`OFFSET`].
#[inline(always)]
fn bytes<S: Simd>(simd: S, inverse: f32, values: &[f32], to: &mut [u8]) {
    // ROUND and the offset are even: ties round as without it.
    const ROUND_UP: f32 = ROUND + OFFSET as f32;
    let to = &mut to[..values.len()];
    let (mut some, mut some_to) = (values.chunks_exact(S::u8s::LEN), to.chunks_exact_mut(S::u8s::LEN));
    for (values, to) in (&mut some).zip(&mut some_to) {
        let mut quarters = [S::u32s::splat(simd, 0); 4];
        for (quarter, values) in quarters.iter_mut().zip(values.chunks_exact(S::f32s::LEN)) {
            *quarter = (S::f32s::from_slice(simd, values) * inverse + ROUND_UP).bitcast();
        }
        let [a, b, c, d] = quarters;
        a.narrow(b).narrow(c.narrow(d)).store_slice(to);
    }
    for (value, to) in some.remainder().iter().zip(some_to.into_remainder()) {
        *to = (value * inverse + ROUND_UP).to_bits() as u8;
    }
}
