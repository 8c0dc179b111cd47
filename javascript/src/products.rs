//! Matrix products in f32, in place of an image's own: the policy before it was quantized.

use actq_kernels::image::{Matrix, Op, OpKind};
use actq_kernels::{Head, Image, StepError};

/// Partial sums of a product, which the compiler keeps in vector registers.
const LANES: usize = 8;

/// The products of an image's operations.
#[derive(Debug)]
pub struct Products<'a> {
    /// Weights of all matrices.
    weights: Vec<f32>,
    /// Operations of the image.
    ops: Vec<Op<'a>>,
    /// Offset of the operation's weights, for those that have some.
    offsets: Vec<Option<usize>>,
}

impl<'a> Products<'a> {
    /// Assigns `weights` to the matrices of an image, each once, in the order of the operations that first use them.
    ///
    /// # Errors
    ///
    /// If the image has more or fewer weights.
    pub fn new(image: &Image<'a>, weights: &[f32]) -> Result<Self, String> {
        let ops: Vec<Op<'a>> = image.ops().collect();
        let mut seen: Vec<(Option<usize>, usize)> = Vec::new();
        let mut len = 0;
        let mut offset = |matrix: Matrix<'_>| {
            let place = matrix.blocks().next().map(|rows| rows.block.rows_from(0).as_ptr() as usize);
            seen.iter().find(|(known, _)| *known == place).map(|(_, offset)| *offset).unwrap_or_else(|| {
                seen.push((place, len));
                len += matrix.rows * matrix.cols;
                len - matrix.rows * matrix.cols
            })
        };
        let offsets = ops.iter().map(|op| op.matrix().map(&mut offset)).collect();
        if len != weights.len() {
            return Err(format!("the image has {len} weights, but {} were given", weights.len()));
        }
        Ok(Self { weights: weights.to_vec(), ops, offsets })
    }

    /// Computes the action of an observation, as [`Head::step`] does.
    ///
    /// # Errors
    ///
    /// Those of [`Head::step`].
    pub fn step<'h>(&self, head: &'h mut Head<'_, '_>, observation: &[f32]) -> Result<&'h [f32], StepError> {
        head.begin_ops(observation)?;
        while let Some(i) = head.next_op() {
            let op = &self.ops[i];
            match (op.kind, op.matrix(), self.offsets[i]) {
                (OpKind::Linear { accumulate, .. }, Some(matrix), Some(offset)) => head.replace_op(|arena| {
                    multiply(op, &matrix, &self.weights[offset..], accumulate, arena);
                    Ok(())
                })?,
                _ => head.run_op()?,
            }
        }
        head.finish_ops()
    }
}

/// Computes `dst = W src + b`, or adds it to `dst`.
fn multiply(op: &Op<'_>, matrix: &Matrix<'_>, weights: &[f32], accumulate: bool, arena: &mut [u32]) {
    let x: Vec<f32> = bytemuck::cast_slice(&arena[op.src().range()]).to_vec();
    let y: &mut [f32] = bytemuck::cast_slice_mut(&mut arena[op.dst().range()]);
    for (row, (y, weights)) in y.iter_mut().zip(weights.chunks_exact(matrix.cols)).enumerate() {
        *y = if accumulate { *y } else { 0.0 } + matrix.bias(row) + dot(weights, &x);
    }
}

fn dot(a: &[f32], b: &[f32]) -> f32 {
    let (a, a_rest) = a.as_chunks::<LANES>();
    let (b, b_rest) = b.as_chunks::<LANES>();
    let mut sums = [0.0; LANES];
    for (a, b) in a.iter().zip(b) {
        sums.iter_mut().zip(a.iter().zip(b)).for_each(|(sum, (a, b))| *sum += a * b);
    }
    sums.iter().sum::<f32>() + a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum::<f32>()
}
