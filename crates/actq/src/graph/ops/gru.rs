use actq_kernels::image::OpKind;
use actq_kernels::math;
use actq_kernels::ops::cells::gru_cell;
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

/// torch's GRU of one layer, one step; gates `[r z n]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Gru {
    /// Length of the state.
    pub hidden: usize,
    /// Matrix W_ih.
    pub input: usize,
    /// Matrix W_hh.
    pub state: usize,
    /// Biases b_ih.
    pub input_bias: Vec<f32>,
    /// Biases b_hh.
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

    fn syntax() -> Vec<Syntax<Self>> {
        let read = |op: &mut dyn Keys| {
            let Parts { hidden, w_ih, w_hh, b_ih, b_hh } = Parts::read(op, "r,z,n")?;
            Ok(Self { hidden, input: w_ih, state: w_hh, input_bias: b_ih, state_bias: b_hh })
        };
        vec![Syntax { name: "gru", keys: KEYS, read }]
    }

    fn products(&self) -> Vec<Product> {
        vec![
            Product { matrix: self.input, bias: 0, operand: Operand::Input },
            Product { matrix: self.state, bias: 1, operand: Operand::State },
        ]
    }

    fn matrices_mut(&mut self) -> Vec<&mut usize> {
        vec![&mut self.input, &mut self.state]
    }

    learned! { input_bias, state_bias }

    fn keep_units(&mut self, len: usize, units: &[usize]) {
        keep(&mut self.input_bias, len, units);
        keep(&mut self.state_bias, len, units);
        self.hidden = units.len();
    }

    fn state_lens(&self) -> [usize; 2] {
        [self.hidden, 0]
    }

    fn forward(&self, run: &Forward<'_>, [h, _]: &mut NodeState) -> (Array2<f32>, Saved) {
        let batch = h.nrows();
        let x = run.operand(self.input, run.input(0).view());
        let a = run.affine(self.input, &x, 0);
        let state = run.matrix(self.state);
        let mut b = Array2::from_shape_fn(a.raw_dim(), |(_, row)| run.vectors[1][row]);
        let before = Array2::zeros((x.nrows(), self.hidden));
        let [mut before, mut h_before, mut y] = [before.clone(), before.clone(), before];
        for step in 0..x.nrows() / batch {
            let of_step = step_rows(step, batch);
            let operand = run.operand(self.state, h.view());
            state.add_product(&operand, rows_mut(&mut b, of_step.clone()));
            rows_mut(&mut before, of_step.clone()).assign(&operand);
            rows_mut(&mut h_before, of_step.clone()).assign(h);
            let (of_input, of_state) = (rows(&a, of_step.clone()), rows(&b, of_step.clone()));
            for ((a, b), mut h) in of_input.rows().into_iter().zip(of_state.rows()).zip(h.rows_mut()) {
                gru_cell(contiguous(&a), contiguous(&b), contiguous_mut(&mut h));
            }
            rows_mut(&mut y, of_step).assign(h);
        }
        (y, Saved { operands: vec![x, before], inner: vec![h_before, a, b] })
    }

    fn backward(&self, run: &mut Backward<'_>, saved: Saved, dy: Array2<f32>, [d_h, _]: &mut NodeState) {
        let (Ok([x, before]), [h_before, a, b]) = (<[_; 2]>::try_from(saved.operands), &saved.inner[..]) else {
            return;
        };
        let back = run.back(self.state);
        let batch = d_h.nrows();
        let (mut d_a, mut d_b) = (Array2::zeros(a.raw_dim()), Array2::zeros(b.raw_dim()));
        for step in (0..dy.nrows() / batch).rev() {
            for (sample, row) in step_rows(step, batch).enumerate() {
                for k in 0..self.hidden {
                    let at = |g: usize| [row, g * self.hidden + k];
                    let r = math::sigmoid(a[at(0)] + b[at(0)]);
                    let z = math::sigmoid(a[at(1)] + b[at(1)]);
                    let n = math::tanh(a[at(2)] + r * b[at(2)]);
                    let dh = dy[[row, k]] + d_h[[sample, k]];
                    let dn = dh * (1.0 - z) * (1.0 - n * n);
                    let dz = dh * (h_before[[row, k]] - n) * z * (1.0 - z);
                    let dr = dn * b[at(2)] * r * (1.0 - r);
                    for (g, da, db) in [(0, dr, dr), (1, dz, dz), (2, dn, dn * r)] {
                        d_a[at(g)] = da;
                        d_b[at(g)] = db;
                    }
                    d_h[[sample, k]] = dh * z;
                }
            }
            *d_h += &back.product(rows(&d_b, step_rows(step, batch)));
        }
        sum_rows(&d_a, &mut run.d_vectors[0]);
        sum_rows(&d_b, &mut run.d_vectors[1]);
        run.give_through(0, self.input, &d_a);
        run.product(self.input, x, d_a);
        run.product(self.state, before, d_b);
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
