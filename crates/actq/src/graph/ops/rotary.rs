use actq_kernels::image::OpKind;
use ndarray::Array2;

use crate::error::{Result, ensure};
use crate::graph::arrays::contiguous_mut;
use crate::graph::lowering::{BufferId, Lowering, StepData};
use crate::graph::operation::{Backward, Elements, Forward, NodeState, Operation, Saved, expect_len, only};
use crate::graph::syntax::{Keys, Syntax, required};
use crate::graph::values::{ValueId, WeightMatrix};

/// Rotary positions of queries or keys `[token, head, element]`: of every head, elements `x_i` and `x_j` with
/// `j = i + dim / 2` become `x_i cos_i - x_j sin_i` and `x_j cos_i + x_i sin_i`.
#[derive(Clone, Debug, PartialEq)]
pub struct Rotary {
    /// Heads of a token.
    pub heads: usize,
    /// Elements of a head, an even number.
    pub dim: usize,
    /// Cosines of the angles, `[token, dim / 2]`.
    pub cos: Vec<f32>,
    /// Sines of the angles, `[token, dim / 2]`.
    pub sin: Vec<f32>,
}

impl Rotary {
    /// Rotates every row by the angles, or back by them if `direction` is -1.
    fn rotated(&self, mut x: Array2<f32>, direction: f32) -> Array2<f32> {
        let half = self.dim / 2;
        for mut row in x.rows_mut() {
            let tokens = contiguous_mut(&mut row).chunks_exact_mut(self.heads * self.dim);
            for ((token, cos), sin) in tokens.zip(self.cos.chunks_exact(half)).zip(self.sin.chunks_exact(half)) {
                for head in token.chunks_exact_mut(self.dim) {
                    let (first, second) = head.split_at_mut(half);
                    for (((x, y), cos), sin) in first.iter_mut().zip(second).zip(cos).zip(sin) {
                        let (a, b, sin) = (*x, *y, direction * sin);
                        (*x, *y) = (a * cos - b * sin, b * cos + a * sin);
                    }
                }
            }
        }
        x
    }
}

impl Operation for Rotary {
    fn output_len(&self, _: &[WeightMatrix], inputs: &[usize]) -> Result<usize> {
        let (len, heads, dim) = (only(inputs)?, self.heads, self.dim);
        ensure!(
            heads > 0 && dim > 0 && dim.is_multiple_of(2) && len.is_multiple_of(heads * dim),
            "its {len} values are not tokens of {heads} heads of {dim} values, an even number"
        );
        expect_len("cos", &self.cos, len / heads / 2)?;
        expect_len("sin", &self.sin, len / heads / 2)?;
        Ok(len)
    }

    fn syntax() -> Vec<Syntax<Self>> {
        let read = |op: &mut dyn Keys| {
            let heads = required(op.count("heads")?, "heads")?;
            let dim = required(op.count("dim")?, "dim")?;
            let len = op.input_len() / heads.max(1) / 2;
            let [cos, sin] = ["cos", "sin"].map(|key| required(op.vector(key, len)?, key));
            Ok(Self { heads, dim, cos: cos?, sin: sin? })
        };
        vec![Syntax { name: "rotary", keys: &["heads", "dim", "cos", "sin"], read }]
    }

    fn elements(&self) -> Elements {
        Elements::Heads(self.dim)
    }

    fn keep_units(&mut self, _: usize, units: &[usize]) {
        self.heads = units.iter().take_while(|unit| **unit < self.heads * self.dim).count() / self.dim;
    }

    fn forward(&self, run: &Forward<'_>, _: &mut NodeState) -> (Array2<f32>, Saved) {
        (self.rotated(run.input(0).clone(), 1.0), Saved::default())
    }

    fn backward(&self, run: &mut Backward<'_>, _: Saved, dy: Array2<f32>, _: &mut NodeState) {
        run.give(0, self.rotated(dy, -1.0));
    }

    fn lower(&self, to: &mut Lowering, inputs: &[ValueId], _: usize) -> BufferId {
        let half = self.dim / 2;
        let tables = self.cos.chunks_exact(half).zip(self.sin.chunks_exact(half));
        let tables = tables.flat_map(|(cos, sin)| cos.iter().chain(sin)).map(|value| value.to_bits());
        let data = [(self.heads | self.dim << 16) as u32].into_iter().chain(tables).collect();
        to.in_place(inputs[0], OpKind::Rotary, StepData::Words(data))
    }
}
