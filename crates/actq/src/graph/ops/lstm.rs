use actq_kernels::image::OpKind;
use actq_kernels::math;
use actq_kernels::ops::cells::lstm_cell;
use ndarray::Array2;

use super::recurrent::{KEYS, Parts};
use crate::error::Result;
use crate::graph::arrays::{contiguous, contiguous_mut, rows, rows_mut, step_rows, sum_rows};
use crate::graph::lowering::{BufferId, Lifetime, Lowering, StepData};
use crate::graph::operation::{
    Backward, Forward, NodeState, Operand, Operation, Product, Saved, expect_len, expect_shape, only,
};
use crate::graph::syntax::{Keys, Syntax};
use crate::graph::units::keep;
use crate::graph::values::{ValueId, WeightMatrix};
use crate::simd::wide;

/// torch's LSTM of one layer, one step; gates `[i f g o]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Lstm {
    /// Length of the state.
    pub hidden: usize,
    /// Matrix W_ih.
    pub input: usize,
    /// Matrix W_hh.
    pub state: usize,
    /// Biases b_ih + b_hh; only their sum is used.
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

    fn syntax() -> Vec<Syntax<Self>> {
        let read = |op: &mut dyn Keys| {
            let Parts { hidden, w_ih, w_hh, b_ih, b_hh } = Parts::read(op, "i,f,g,o")?;
            // Only the sum of both biases is used.
            let bias = b_ih.iter().zip(&b_hh).map(|(a, b)| a + b).collect();
            Ok(Self { hidden, input: w_ih, state: w_hh, bias })
        };
        vec![Syntax { name: "lstm", keys: KEYS, read }]
    }

    fn products(&self) -> Vec<Product> {
        vec![
            Product { matrix: self.input, bias: 0, operand: Operand::Input },
            Product { matrix: self.state, bias: 0, operand: Operand::State },
        ]
    }

    fn matrices_mut(&mut self) -> Vec<&mut usize> {
        vec![&mut self.input, &mut self.state]
    }

    learned! { bias }

    fn trained_values(&self) -> usize {
        // torch stores both biases.
        2 * self.bias.len()
    }

    fn keep_units(&mut self, len: usize, units: &[usize]) {
        keep(&mut self.bias, len, units);
        self.hidden = units.len();
    }

    fn state_lens(&self) -> [usize; 2] {
        [self.hidden, self.hidden]
    }

    fn forward(&self, run: &Forward<'_>, [h, c]: &mut NodeState) -> (Array2<f32>, Saved) {
        let batch = h.nrows();
        let x = run.operand(self.input, run.input(0).view());
        let mut gates = run.affine(self.input, &x, 0);
        let state = run.matrix(self.state);
        let before = Array2::zeros((x.nrows(), self.hidden));
        let [mut before, mut c_before, mut y] = [before.clone(), before.clone(), before];
        for step in 0..x.nrows() / batch {
            let of_step = step_rows(step, batch);
            let operand = run.operand(self.state, h.view());
            state.add_product(&operand, rows_mut(&mut gates, of_step.clone()));
            rows_mut(&mut before, of_step.clone()).assign(&operand);
            rows_mut(&mut c_before, of_step.clone()).assign(c);
            let gates = rows(&gates, of_step.clone());
            for ((gates, mut c), mut h) in gates.rows().into_iter().zip(c.rows_mut()).zip(h.rows_mut()) {
                lstm_cell(contiguous(&gates), contiguous_mut(&mut c), contiguous_mut(&mut h));
            }
            rows_mut(&mut y, of_step).assign(h);
        }
        (y, Saved { operands: vec![x, before], inner: vec![c_before, gates] })
    }

    fn backward(&self, run: &mut Backward<'_>, saved: Saved, dy: Array2<f32>, [d_h, d_c]: &mut NodeState) {
        let (Ok([x, before]), [c_before, gates]) = (<[_; 2]>::try_from(saved.operands), &saved.inner[..]) else {
            return;
        };
        let back = run.back(self.state);
        let batch = d_h.nrows();
        let mut d_gates = Array2::zeros(gates.raw_dim());
        for step in (0..dy.nrows() / batch).rev() {
            for (sample, row) in step_rows(step, batch).enumerate() {
                let (mut d_gates, mut d_c) = (d_gates.row_mut(row), d_c.row_mut(sample));
                let dy = dy.row(row);
                let d_h = d_h.row(sample);
                let dh: Vec<f32> = contiguous(&dy).iter().zip(contiguous(&d_h)).map(|(a, b)| a + b).collect();
                let (gates, c_before) = (gates.row(row), c_before.row(row));
                let (gates, c_before) = (contiguous(&gates), contiguous(&c_before));
                let (d_gates, d_c) = (contiguous_mut(&mut d_gates), contiguous_mut(&mut d_c));
                wide(
                    #[inline(always)]
                    || derivative(gates, c_before, &dh, d_gates, d_c),
                );
            }
            *d_h = back.product(rows(&d_gates, step_rows(step, batch)));
        }
        sum_rows(&d_gates, &mut run.d_vectors[0]);
        run.give_through(0, self.input, &d_gates);
        run.product(self.input, x, d_gates.clone());
        run.product(self.state, before, d_gates);
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

/// Computes the derivatives of one cell from those by its hidden state `d_h` and by its new cell state `d_c`; `d_c`
/// becomes the derivative by the previous cell state.
#[inline(always)]
fn derivative(gates: &[f32], c_before: &[f32], d_h: &[f32], d_gates: &mut [f32], d_c: &mut [f32]) {
    let n = d_h.len();
    let ([i, f, g, o], [d_i, d_f, d_g, d_o]) = (quarters(gates, n), quarters_mut(d_gates, n));
    let (c_before, d_c) = (&c_before[..n], &mut d_c[..n]);
    for k in 0..n {
        let (i, f, g, o) = (math::sigmoid(i[k]), math::sigmoid(f[k]), math::tanh(g[k]), math::sigmoid(o[k]));
        let c = math::tanh(f * c_before[k] + i * g);
        let dc = d_c[k] + d_h[k] * o * (1.0 - c * c);
        d_i[k] = dc * g * i * (1.0 - i);
        d_f[k] = dc * c_before[k] * f * (1.0 - f);
        d_g[k] = dc * i * (1.0 - g * g);
        d_o[k] = d_h[k] * c * o * (1.0 - o);
        d_c[k] = dc * f;
    }
}

fn quarters(gates: &[f32], n: usize) -> [&[f32]; 4] {
    [0, 1, 2, 3].map(|gate| &gates[gate * n..][..n])
}

fn quarters_mut(gates: &mut [f32], n: usize) -> [&mut [f32]; 4] {
    let (i, gates) = gates.split_at_mut(n);
    let (f, gates) = gates.split_at_mut(n);
    let (g, o) = gates.split_at_mut(n);
    [i, f, g, o]
}
