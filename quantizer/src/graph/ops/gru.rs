use actq_kernels::image::OpKind;
use actq_kernels::math;
use actq_kernels::ops::cells::gru_cell;
use anyhow::Result;
use ndarray::Array2;

use crate::graph::arrays::{contiguous, contiguous_mut, sum_rows};
use crate::graph::lowering::{BufferId, Lifetime, Lowering, StepData};
use crate::graph::operation::{
    Backward, Forward, NodeState, Operand, Operation, Product, Saved, expect_len, expect_shape, only,
};
use crate::graph::values::{ValueId, WeightMatrix};

/// torch's GRU, one layer, one step; gates `[r z n]`.
#[derive(Clone, Debug)]
pub struct Gru {
    /// Length of the state.
    pub hidden: usize,
    /// W_ih
    pub input: usize,
    /// W_hh
    pub state: usize,
    /// b_ih
    pub input_bias: Vec<f32>,
    /// b_hh
    pub state_bias: Vec<f32>,
}

impl Operation for Gru {
    fn output_len(&self, matrices: &[WeightMatrix], inputs: &[usize]) -> Result<usize> {
        let gates = Some(3 * self.hidden);
        expect_shape(matrices, self.input, gates, only(inputs)?)?;
        expect_shape(matrices, self.state, gates, self.hidden)?;
        expect_len("the input's bias", &self.input_bias, 3 * self.hidden)?;
        expect_len("the state's bias", &self.state_bias, 3 * self.hidden)?;
        Ok(self.hidden)
    }

    fn products(&self) -> Vec<Product> {
        vec![
            Product { matrix: self.input, bias: 0, operand: Operand::Input },
            Product { matrix: self.state, bias: 1, operand: Operand::State },
        ]
    }

    fn vectors(&self) -> Vec<&Vec<f32>> {
        vec![&self.input_bias, &self.state_bias]
    }

    fn vectors_mut(&mut self) -> Vec<&mut Vec<f32>> {
        vec![&mut self.input_bias, &mut self.state_bias]
    }

    fn state_lens(&self) -> [usize; 2] {
        [self.hidden, 0]
    }

    fn forward(&self, run: &Forward<'_>, [h, _]: &mut NodeState) -> (Array2<f32>, Saved) {
        let (x, before) = (run.operand(self.input, run.input(0)), run.operand(self.state, h));
        let a = run.affine(&[(self.input, &x)], 0);
        let b = run.affine(&[(self.state, &before)], 1);
        let h_before = h.clone();
        for ((a, b), mut h) in a.rows().into_iter().zip(b.rows()).zip(h.rows_mut()) {
            gru_cell(contiguous(&a), contiguous(&b), contiguous_mut(&mut h));
        }
        (h.clone(), Saved { operands: vec![x, before], inner: vec![h_before, a, b] })
    }

    fn backward(&self, run: &mut Backward<'_>, saved: &Saved, mut dy: Array2<f32>, [d_h, _]: &mut NodeState) {
        let [h_before, a, b] = &saved.inner[..] else { return };
        dy += &*d_h;
        let (mut d_a, mut d_b) = (Array2::zeros(a.raw_dim()), Array2::zeros(b.raw_dim()));
        for sample in 0..dy.nrows() {
            for k in 0..self.hidden {
                let at = |g: usize| [sample, g * self.hidden + k];
                let r = math::sigmoid(a[at(0)] + b[at(0)]);
                let z = math::sigmoid(a[at(1)] + b[at(1)]);
                let n = math::tanh(a[at(2)] + r * b[at(2)]);
                let dh = dy[[sample, k]];
                let dn = dh * (1.0 - z) * (1.0 - n * n);
                let dz = dh * (h_before[[sample, k]] - n) * z * (1.0 - z);
                let dr = dn * b[at(2)] * r * (1.0 - r);
                for (g, da, db) in [(0, dr, dr), (1, dz, dz), (2, dn, dn * r)] {
                    d_a[at(g)] = da;
                    d_b[at(g)] = db;
                }
                d_h[[sample, k]] = dh * z;
            }
        }
        run.product(0, self.input, &saved.operands[0], &d_a);
        run.product(1, self.state, &saved.operands[1], &d_b);
        sum_rows(&d_a, &mut run.d_vectors[0]);
        sum_rows(&d_b, &mut run.d_vectors[1]);
        *d_h += &run.through(self.state, &d_b);
        run.give_through(0, self.input, &d_a);
    }

    fn lower(&self, to: &mut Lowering, inputs: &[ValueId], _: usize) -> BufferId {
        let h = to.buffer(self.hidden, Lifetime::State);
        let input = to.buffer(3 * self.hidden, Lifetime::Step);
        let state = to.buffer(3 * self.hidden, Lifetime::Step);
        to.product((self.input, &self.input_bias), to.place(inputs[0]), input, false);
        to.product((self.state, &self.state_bias), to.whole(h), state, false);
        to.emit(OpKind::GruCell, to.whole(h), Some(to.whole(input)), Some(to.whole(state)), StepData::None);
        h
    }
}
