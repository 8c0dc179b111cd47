//! An image's network with its activations in f32: what is left of the error when only the weights are quantized.

use actq_kernels::dequantize::row_f32;
use actq_kernels::image::{Op, Region};
use actq_kernels::linear::Matrix;
use actq_kernels::{Image, norm, recurrent};
use ndarray::{Array2, ArrayView1};

/// Runs the operations of an image over an arena of f32; only linear operations differ from the executor's.
pub struct Unrounded<'a> {
    image: Image<'a>,
    ops: Vec<Op<'a>>,
    /// The weights of each operation; empty where it has none.
    weights: Vec<Array2<f32>>,
    arena: Vec<f32>,
}

impl<'a> Unrounded<'a> {
    /// Takes the weights out of an image.
    pub fn new(image: Image<'a>) -> Self {
        let ops: Vec<Op<'a>> = image.ops().collect();
        let weights = ops.iter().map(|op| match op {
            Op::Linear { matrix, .. } => dequantized(matrix),
            _ => Array2::default((0, 0)),
        });
        Self { image, weights: weights.collect(), ops, arena: vec![0.0; image.scratch_words()] }
    }

    /// The recurrent state.
    pub fn state_mut(&mut self) -> &mut [f32] {
        &mut self.arena[self.image.state().range()]
    }

    /// The network's raw output for an observation of the image's length.
    pub fn infer(&mut self, observation: &[f32]) -> &[f32] {
        let arena = &mut self.arena;
        arena[self.image.observation().range()].copy_from_slice(observation);
        for (op, weights) in self.ops.iter().zip(&self.weights) {
            run(op, weights, arena);
        }
        &arena[self.image.output().range()]
    }
}

fn dequantized(matrix: &Matrix<'_>) -> Array2<f32> {
    let mut weights = Array2::zeros((matrix.rows, matrix.cols));
    let mut row = vec![0.0; matrix.cols];
    for rows in matrix.blocks() {
        for i in 0..rows.block.shape().rows {
            row_f32(&rows, i, &mut row);
            weights.row_mut(rows.output(i)).assign(&ArrayView1::from(&row));
        }
    }
    weights
}

fn run(op: &Op<'_>, weights: &Array2<f32>, arena: &mut [f32]) {
    let copy = |arena: &[f32], region: Region| arena[region.range()].to_vec();
    match *op {
        Op::Normalize { src, dst, mean, scale, pre_clip, clip } => {
            let x = copy(arena, src);
            norm::normalize(&x, mean, scale, pre_clip, clip, &mut arena[dst.range()]);
        }
        Op::Linear { src, dst, matrix, accumulate } => {
            let product = weights.dot(&ArrayView1::from(&arena[src.range()]));
            for (row, (y, sum)) in arena[dst.range()].iter_mut().zip(product).enumerate() {
                *y = if accumulate { *y } else { 0.0 } + matrix.bias(row) + sum;
            }
        }
        Op::Function { dst, function } => function.apply(&mut arena[dst.range()]),
        Op::LayerNorm { dst, weight, bias, eps } => norm::layer_norm(&mut arena[dst.range()], weight, bias, eps),
        Op::RmsNorm { dst, weight, eps } => norm::rms_norm(&mut arena[dst.range()], weight, eps),
        Op::Add { src, dst } => {
            let x = copy(arena, src);
            arena[dst.range()].iter_mut().zip(x).for_each(|(y, x)| *y += x);
        }
        Op::Copy { src, dst } => {
            let x = copy(arena, src);
            arena[dst.range()].copy_from_slice(&x);
        }
        Op::LstmCell { src, dst, cell } => {
            let (gates, mut c) = (copy(arena, src), copy(arena, cell));
            recurrent::lstm_cell(&gates, &mut c, &mut arena[dst.range()]);
            arena[cell.range()].copy_from_slice(&c);
        }
        Op::GruCell { src, dst, hidden } => {
            let (a, b) = (copy(arena, src), copy(arena, hidden));
            recurrent::gru_cell(&a, &b, &mut arena[dst.range()]);
        }
    }
}
