//! A linear operation for several heads: its matrix in the form that [`product`] multiplies, and what is done for each
//! head before and after the sums, in the order of operations of `actq-kernels`' `ops/linear.rs`.

use actq_kernels::StepError;
use actq_kernels::image::{Matrix, Op, OpKind, Region};
use actq_kernels::round::ROUND;
use actq_kernels::x::Scale;
use fearless_simd::Simd;

use crate::product::{Activations, COLS, HEADS, ROWS, Weights, product};

/// A linear operation.
#[derive(Debug)]
pub(crate) struct Linear {
    pub(crate) src: Region,
    dst: Region,
    x_max: u16,
    accumulate: bool,
    /// The biases, or zeros if an output starts without; empty if it keeps its value.
    biases: Vec<f32>,
    /// Steps of [`COLS`] columns.
    steps: usize,
    weights: Vec<Weights>,
    /// Output and scale of each row that has weights, in the order of the outputs.
    rows: Vec<(usize, f32)>,
    /// `true` if every output has a row.
    is_whole: bool,
}

/// Vectors and sums of several heads.
#[derive(Debug, Default)]
pub(crate) struct Operands {
    x: Vec<Activations>,
    /// Scales of the vectors.
    scales: Vec<f32>,
    sums: Vec<[i32; ROWS]>,
}

impl Linear {
    /// Unpacks the matrix of an operation; `None` if the operation is not linear.
    pub(crate) fn new(op: &Op<'_>) -> Option<Self> {
        let (OpKind::Linear { accumulate }, Some(matrix)) = (op.kind, op.matrix()) else { return None };
        let mut rows: Vec<_> = matrix
            .blocks()
            .flat_map(|rows| rows.outputs().enumerate().map(move |(i, output)| (output, rows, i)))
            .collect();
        // Of two rows with one output, the first of the image is added first.
        rows.sort_by_key(|(output, ..)| *output);
        let steps = matrix.cols.div_ceil(COLS);
        let mut weights = vec![[[0; COLS]; ROWS]; rows.len().div_ceil(ROWS) * steps];
        for (at, (_, rows, i)) in rows.iter().enumerate() {
            let weights = &mut weights[at / ROWS * steps..][..steps];
            for col in 0..matrix.cols {
                let weight = rows.block.level(*i, col) * i32::from(rows.block.group_scale(*i, col));
                // A level is in -128 ..= 127, and a scale at most 255.
                weights[col / COLS][at % ROWS][col % COLS] = weight as i16;
            }
        }
        let rows: Vec<_> = rows.iter().map(|(output, rows, i)| (*output, rows.scale(*i))).collect();
        let is_whole = rows.len() == matrix.rows && rows.iter().enumerate().all(|(i, (output, _))| i == *output);
        let biases = if accumulate && !matrix.has_bias() { Vec::new() } else { biases(&matrix) };
        let (src, dst) = (op.src(), op.dst());
        Some(Self { src, dst, x_max: matrix.x_max, accumulate, biases, steps, weights, rows, is_whole })
    }

    /// Prepares for `heads` vectors.
    pub(crate) fn begin(&self, operands: &mut Operands, heads: usize) {
        let heads = heads.next_multiple_of(HEADS);
        operands.x.resize(heads / HEADS * self.steps, [[0; COLS]; HEADS]);
        operands.sums.resize(heads * self.rows.len().div_ceil(ROWS), [0; ROWS]);
        operands.scales.clear();
    }

    /// Quantizes the next head's vector.
    ///
    /// # Errors
    ///
    /// [`StepError::NotFinite`] if a value is NaN or infinite; then the next vector takes this one's place.
    #[inline(always)]
    pub(crate) fn quantize<S: Simd>(&self, _: S, operands: &mut Operands, x: &[u32]) -> Result<(), StepError> {
        // Without their signs, bits compare as whole numbers, and signed ones suit more instruction sets.
        let magnitude = x.iter().fold(0, |most, bits| most.max((bits & 0x7fff_ffff) as i32));
        let scale = Scale::of_magnitude(magnitude as u32, self.x_max).map_err(|_| StepError::NotFinite)?;
        let inverse = scale.inverse();
        let integer = |bits: u32| (f32::from_bits(bits) * inverse + ROUND).to_bits() as i16;
        let head = operands.scales.len();
        let steps = &mut operands.x[head / HEADS * self.steps..][..self.steps];
        let (whole, rest) = x.as_chunks::<COLS>();
        for (to, from) in steps.iter_mut().zip(whole) {
            to[head % HEADS] = from.map(integer);
        }
        if let Some(step) = steps.get_mut(whole.len()) {
            step[head % HEADS] = [0; COLS];
            step[head % HEADS].iter_mut().zip(rest).for_each(|(to, from)| *to = integer(*from));
        }
        operands.scales.push(scale.get());
        Ok(())
    }

    /// Computes the sums of all vectors.
    #[inline(always)]
    pub(crate) fn multiply<S: Simd>(&self, simd: S, operands: &mut Operands) {
        product(simd, self.steps, &self.weights, &operands.x, &mut operands.sums);
    }

    /// Computes the outputs of the head with this vector, in its arena.
    #[inline(always)]
    pub(crate) fn scale_back<S: Simd>(&self, _: S, operands: &Operands, vector: usize, arena: &mut [u32]) {
        let (scale, rows) = (operands.scales[vector], self.rows.len().div_ceil(ROWS));
        let sums = operands.sums[vector * rows..][..rows].as_flattened();
        let y: &mut [f32] = bytemuck::must_cast_slice_mut(&mut arena[self.dst.range()]);
        if self.accumulate {
            y.iter_mut().zip(&self.biases).for_each(|(y, bias)| *y += bias);
        } else {
            y.copy_from_slice(&self.biases);
        }
        let scaled =
            sums.iter().zip(&self.rows).map(|(sum, (output, row_scale))| (*output, *sum as f32 * (row_scale * scale)));
        if self.is_whole {
            y.iter_mut().zip(scaled).for_each(|(y, (_, x))| *y += x);
        } else {
            scaled.for_each(|(output, x)| y[output] += x);
        }
    }
}

fn biases(matrix: &Matrix<'_>) -> Vec<f32> {
    (0..matrix.rows).map(|row| matrix.bias(row)).collect()
}
