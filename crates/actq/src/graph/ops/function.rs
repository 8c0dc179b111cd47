use actq_kernels::image::OpKind;
use actq_kernels::math::{self, Function};
use ndarray::Array2;

use crate::error::{Context, Result, bail};
use crate::graph::arrays::{contiguous, contiguous_mut};
use crate::graph::lowering::{BufferId, Lowering, StepData};
use crate::graph::operation::{Backward, Forward, NodeState, Operation, Saved, only};
use crate::graph::syntax::{Keys, Syntax};
use crate::graph::values::{ValueId, WeightMatrix};
use crate::simd::wide;

/// A function of every element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pointwise(pub Function);

impl Operation for Pointwise {
    fn output_len(&self, _: &[WeightMatrix], inputs: &[usize]) -> Result<usize> {
        only(inputs)
    }

    fn syntax() -> Vec<Syntax<Self>> {
        let read = |op: &mut dyn Keys| {
            let name = match (op.op(), op.text("approximate")?) {
                ("gelu", Some("tanh")) => Function::GeluTanh.name(),
                (name, None | Some("none")) => name,
                (_, Some(other)) => bail!("approximate {other:?} is not known; use none or tanh"),
            };
            Function::ALL.into_iter().find(|f| f.name() == name).map(Self).context("unknown function")
        };
        let keys = |f| if f == Function::Gelu { &["approximate"][..] } else { &[] };
        Function::ALL.map(|f| Syntax { name: f.name(), keys: keys(f), read }).to_vec()
    }

    fn forward(&self, run: &Forward<'_>, _: &mut NodeState) -> (Array2<f32>, Saved) {
        let mut y = run.input(0).clone();
        for mut row in y.rows_mut() {
            let row = contiguous_mut(&mut row);
            wide(
                #[inline(always)]
                || self.0.apply_inlined(row),
            );
        }
        (y, Saved::default())
    }

    fn backward(&self, run: &mut Backward<'_>, _: Saved, mut dy: Array2<f32>, _: &mut NodeState) {
        for ((mut dy, x), y) in dy.rows_mut().into_iter().zip(run.input(0).rows()).zip(run.output().rows()) {
            let (dy, x, y) = (contiguous_mut(&mut dy), contiguous(&x), contiguous(&y));
            wide(
                #[inline(always)]
                || back(self.0, dy, x, y),
            );
        }
        run.give(0, dy);
    }

    fn lower(&self, to: &mut Lowering, inputs: &[ValueId], _: usize) -> BufferId {
        to.in_place(inputs[0], OpKind::Function(self.0), StepData::None)
    }
}

/// Multiplies `d` by the derivative of a function at `x` with the values `y`.
#[inline(always)]
fn back(function: Function, d: &mut [f32], x: &[f32], y: &[f32]) {
    match function {
        Function::Relu => times(d, x, y, |x, _| if x > 0.0 { 1.0 } else { 0.0 }),
        Function::Elu => times(d, x, y, |x, y| if x > 0.0 { 1.0 } else { y + 1.0 }),
        Function::Silu => times(d, x, y, |x, y| {
            let s = math::sigmoid(x);
            s + y * (1.0 - s)
        }),
        Function::Gelu => times(d, x, y, |x, y| {
            // Phi(x) + x phi(x); Phi is y / x away from zero.
            let phi = 0.398_942_3 * math::exp(-0.5 * x * x);
            let cumulative = if x.abs() > 1e-2 { y / x } else { 0.5 + 0.398_942_3 * x };
            cumulative + x * phi
        }),
        Function::GeluTanh => times(d, x, y, |x, y| {
            let s = math::sigmoid(1.595_769 * (x + 0.044_715 * x * x * x));
            s + y * (1.0 - s) * 1.595_769 * (1.0 + 0.134_145 * x * x)
        }),
        Function::Tanh => times(d, x, y, |_, y| 1.0 - y * y),
        Function::Sigmoid => times(d, x, y, |_, y| y * (1.0 - y)),
        Function::Exp => times(d, x, y, |_, y| y),
        Function::Sin => times(d, x, y, |x, _| math::cos(x)),
        Function::Cos => times(d, x, y, |x, _| -math::sin(x)),
        Function::Softplus => times(d, x, y, |x, _| math::sigmoid(x)),
        Function::Mish => times(d, x, y, |x, _| {
            let t = math::tanh(math::softplus(x));
            t + x * (1.0 - t * t) * math::sigmoid(x)
        }),
    }
}

#[inline(always)]
fn times(d: &mut [f32], x: &[f32], y: &[f32], derivative: impl Fn(f32, f32) -> f32) {
    for (d, (x, y)) in d.iter_mut().zip(x.iter().zip(y)) {
        *d *= derivative(*x, *y);
    }
}
