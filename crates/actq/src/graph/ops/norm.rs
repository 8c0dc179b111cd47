use actq_kernels::image::OpKind;
use ndarray::Array2;

use crate::error::Result;
use crate::graph::arrays::{contiguous, contiguous_mut, sum, sum_of_products, sum_rows};
use crate::graph::lowering::{BufferId, Lowering, StepData};
use crate::graph::operation::{Backward, Forward, NodeState, Operation, Saved, expect_len, only};
use crate::graph::syntax::{Keys, Syntax, required};
use crate::graph::values::{ValueId, WeightMatrix};
use crate::numbers::positive;
use crate::simd::wide;

/// torch's LayerNorm: `(x - mean(x)) / sqrt(var(x) + eps) * weight + bias`
#[derive(Clone, Debug, PartialEq)]
pub struct LayerNorm {
    /// Weights.
    pub weight: Vec<f32>,
    /// Biases.
    pub bias: Vec<f32>,
    /// Constant added to the variance.
    pub eps: f32,
}

/// `x / sqrt(mean(x^2) + eps) * weight`
#[derive(Clone, Debug, PartialEq)]
pub struct RmsNorm {
    /// Weights.
    pub weight: Vec<f32>,
    /// Constant added to the mean square.
    pub eps: f32,
}

impl Operation for LayerNorm {
    fn output_len(&self, _: &[WeightMatrix], inputs: &[usize]) -> Result<usize> {
        let len = only(inputs)?;
        expect_len("weight", &self.weight, len)?;
        expect_len("bias", &self.bias, len)?;
        Ok(len)
    }

    fn syntax() -> Vec<Syntax<Self>> {
        let read = |op: &mut dyn Keys| {
            let len = op.input_len();
            Ok(Self {
                weight: required(op.vector("w_ln", len)?, "w_ln")?,
                bias: op.bias("b_ln", len)?,
                eps: positive(op.number("eps")?.unwrap_or(1e-5), "eps")?,
            })
        };
        vec![Syntax { name: "layernorm", keys: &["w_ln", "b_ln", "eps"], read }]
    }

    learned! { weight, bias }

    fn forward(&self, run: &Forward<'_>, _: &mut NodeState) -> (Array2<f32>, Saved) {
        normalized(run, self.eps, true)
    }

    fn backward(&self, run: &mut Backward<'_>, saved: Saved, dy: Array2<f32>, _: &mut NodeState) {
        sum_rows(&dy, &mut run.d_vectors[1]);
        back(run, &saved, dy, true);
    }

    fn lower(&self, to: &mut Lowering, inputs: &[ValueId], _: usize) -> BufferId {
        let data = StepData::Constants([&[self.eps], &self.weight[..], &self.bias].concat());
        to.in_place(inputs[0], OpKind::LayerNorm, data)
    }
}

impl Operation for RmsNorm {
    fn output_len(&self, _: &[WeightMatrix], inputs: &[usize]) -> Result<usize> {
        let len = only(inputs)?;
        expect_len("weight", &self.weight, len)?;
        Ok(len)
    }

    fn syntax() -> Vec<Syntax<Self>> {
        let read = |op: &mut dyn Keys| {
            Ok(Self {
                weight: required(op.vector("w_ln", op.input_len())?, "w_ln")?,
                eps: positive(op.number("eps")?.unwrap_or(1e-6), "eps")?,
            })
        };
        vec![Syntax { name: "rmsnorm", keys: &["w_ln", "eps"], read }]
    }

    learned! { weight }

    fn forward(&self, run: &Forward<'_>, _: &mut NodeState) -> (Array2<f32>, Saved) {
        normalized(run, self.eps, false)
    }

    fn backward(&self, run: &mut Backward<'_>, saved: Saved, dy: Array2<f32>, _: &mut NodeState) {
        back(run, &saved, dy, false);
    }

    fn lower(&self, to: &mut Lowering, inputs: &[ValueId], _: usize) -> BufferId {
        let data = StepData::Constants([&[self.eps], &self.weight[..]].concat());
        to.in_place(inputs[0], OpKind::RmsNorm, data)
    }
}

/// Computes either norm; keeps the normalized values and the reciprocal deviation of each sample.
fn normalized(run: &Forward<'_>, eps: f32, centred: bool) -> (Array2<f32>, Saved) {
    let mut hat = run.input(0).clone();
    let mut y = Array2::zeros(hat.raw_dim());
    let mut inverses = Array2::zeros((hat.nrows(), 1));
    let (weight, bias) = (&run.vectors[0][..], run.vectors.get(1).map_or(&[][..], Vec::as_slice));
    for ((mut hat, mut y), inverse) in hat.rows_mut().into_iter().zip(y.rows_mut()).zip(&mut inverses) {
        let (hat, y) = (contiguous_mut(&mut hat), contiguous_mut(&mut y));
        *inverse = wide(
            #[inline(always)]
            || {
                let inverse = normalize(hat, eps, centred);
                y.iter_mut().zip(&*hat).zip(weight).for_each(|((y, hat), weight)| *y = hat * weight);
                y.iter_mut().zip(bias).for_each(|(y, bias)| *y += bias);
                inverse
            },
        );
    }
    (y, Saved { inner: vec![hat, inverses], ..Saved::default() })
}

/// Normalizes a sample; returns the reciprocal of its deviation.
#[inline(always)]
fn normalize(x: &mut [f32], eps: f32, centred: bool) -> f32 {
    let n = x.len() as f32;
    if centred {
        let mean = sum(x, |v| v) / n;
        x.iter_mut().for_each(|v| *v -= mean);
    }
    let inverse = 1.0 / (sum(x, |v| v * v) / n + eps).sqrt();
    x.iter_mut().for_each(|v| *v *= inverse);
    inverse
}

/// Backpropagates through either norm, except for the derivative by the bias.
fn back(run: &mut Backward<'_>, saved: &Saved, mut dy: Array2<f32>, centred: bool) {
    let weight = &run.vectors[0];
    let d_weight = &mut run.d_vectors[0];
    for ((mut d, hat), inverse) in dy.rows_mut().into_iter().zip(saved.inner[0].rows()).zip(&saved.inner[1]) {
        let (d, hat) = (contiguous_mut(&mut d), contiguous(&hat));
        wide(
            #[inline(always)]
            || {
                d_weight.iter_mut().zip(&*d).zip(hat).for_each(|((sum, d), hat)| *sum += d * hat);
                d.iter_mut().zip(weight).for_each(|(d, weight)| *d *= weight);
                let n = d.len() as f32;
                let mean = if centred { sum(d, |d| d) / n } else { 0.0 };
                let along = sum_of_products(d, hat) / n;
                d.iter_mut().zip(hat).for_each(|(d, hat)| *d = (*d - mean - hat * along) * inverse);
            },
        );
    }
    run.give(0, dy);
}
