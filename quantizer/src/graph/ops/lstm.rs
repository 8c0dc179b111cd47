use actq_kernels::image::OpKind;
use actq_kernels::math;
use actq_kernels::ops::cells::lstm_cell;
use anyhow::Result;
use ndarray::Array2;

use crate::graph::arrays::{contiguous, contiguous_mut, sum_rows};
use crate::graph::lowering::{BufferId, Lifetime, Lowering, StepData};
use crate::graph::operation::{
    Backward, Forward, NodeState, Operand, Operation, Product, Saved, expect_len, expect_shape, only,
};
use crate::graph::values::{ValueId, WeightMatrix};

/// torch's LSTM, one layer, one step; gates `[i f g o]`.
#[derive(Clone, Debug)]
pub struct Lstm {
    /// Length of the state.
    pub hidden: usize,
    /// W_ih
    pub input: usize,
    /// W_hh
    pub state: usize,
    /// b_ih + b_hh, which only ever occur as their sum.
    pub bias: Vec<f32>,
}

impl Operation for Lstm {
    fn output_len(&self, matrices: &[WeightMatrix], inputs: &[usize]) -> Result<usize> {
        let gates = Some(4 * self.hidden);
        expect_shape(matrices, self.input, gates, only(inputs)?)?;
        expect_shape(matrices, self.state, gates, self.hidden)?;
        expect_len("bias", &self.bias, 4 * self.hidden)?;
        Ok(self.hidden)
    }

    fn products(&self) -> Vec<Product> {
        vec![
            Product { matrix: self.input, bias: 0, operand: Operand::Input },
            Product { matrix: self.state, bias: 0, operand: Operand::State },
        ]
    }

    fn vectors(&self) -> Vec<&Vec<f32>> {
        vec![&self.bias]
    }

    fn vectors_mut(&mut self) -> Vec<&mut Vec<f32>> {
        vec![&mut self.bias]
    }

    fn constants(&self) -> usize {
        // torch stores both biases.
        2 * self.bias.len()
    }

    fn state_lens(&self) -> [usize; 2] {
        [self.hidden, self.hidden]
    }

    fn forward(&self, run: &Forward<'_>, [h, c]: &mut NodeState) -> (Array2<f32>, Saved) {
        let (x, before) = (run.operand(self.input, run.input(0)), run.operand(self.state, h));
        let gates = run.affine(&[(self.input, &x), (self.state, &before)], 0);
        let c_before = c.clone();
        for ((gates, mut c), mut h) in gates.rows().into_iter().zip(c.rows_mut()).zip(h.rows_mut()) {
            lstm_cell(contiguous(&gates), contiguous_mut(&mut c), contiguous_mut(&mut h));
        }
        (h.clone(), Saved { operands: vec![x, before], inner: vec![c_before, gates, c.clone()] })
    }

    fn backward(&self, run: &mut Backward<'_>, saved: &Saved, mut dy: Array2<f32>, [d_h, d_c]: &mut NodeState) {
        let [c_before, gates, c] = &saved.inner[..] else { return };
        dy += &*d_h;
        let mut d_gates = Array2::zeros(gates.raw_dim());
        for sample in 0..dy.nrows() {
            for k in 0..self.hidden {
                let gate = |g: usize| gates[[sample, g * self.hidden + k]];
                let (ig, fg) = (math::sigmoid(gate(0)), math::sigmoid(gate(1)));
                let (gg, og) = (math::tanh(gate(2)), math::sigmoid(gate(3)));
                let tc = math::tanh(c[[sample, k]]);
                let dh = dy[[sample, k]];
                let dc = d_c[[sample, k]] + dh * og * (1.0 - tc * tc);
                let mut set = |g: usize, v: f32| d_gates[[sample, g * self.hidden + k]] = v;
                set(0, dc * gg * ig * (1.0 - ig));
                set(1, dc * c_before[[sample, k]] * fg * (1.0 - fg));
                set(2, dc * ig * (1.0 - gg * gg));
                set(3, dh * tc * og * (1.0 - og));
                d_c[[sample, k]] = dc * fg;
            }
        }
        run.product(0, self.input, &saved.operands[0], &d_gates);
        run.product(1, self.state, &saved.operands[1], &d_gates);
        sum_rows(&d_gates, &mut run.d_vectors[0]);
        *d_h = run.through(self.state, &d_gates);
        run.give_through(0, self.input, &d_gates);
    }

    fn lower(&self, to: &mut Lowering, inputs: &[ValueId], _: usize) -> BufferId {
        let h = to.buffer(self.hidden, Lifetime::State);
        let c = to.buffer(self.hidden, Lifetime::State);
        let gates = to.buffer(4 * self.hidden, Lifetime::Step);
        to.product((self.input, &self.bias), to.place(inputs[0]), gates, false);
        to.product((self.state, &[]), to.whole(h), gates, true);
        to.emit(OpKind::LstmCell, to.whole(h), Some(to.whole(gates)), Some(to.whole(c)), StepData::None);
        h
    }
}
