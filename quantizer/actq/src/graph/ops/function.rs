use actq_kernels::image::OpKind;
use actq_kernels::math::{self, Function};
use ndarray::{Array2, Zip};

use crate::error::{Context, Result, bail};
use crate::graph::arrays::contiguous_mut;
use crate::graph::lowering::{BufferId, Lowering, StepData};
use crate::graph::operation::{Backward, Forward, NodeState, Operation, Saved, only};
use crate::graph::syntax::{Keys, Syntax};
use crate::graph::values::{ValueId, WeightMatrix};

/// A function of every element.
#[derive(Clone, Copy, Debug)]
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
            self.0.apply(contiguous_mut(&mut row));
        }
        (y, Saved::default())
    }

    fn backward(&self, run: &mut Backward<'_>, _: &Saved, mut dy: Array2<f32>, _: &mut NodeState) {
        let derivative = derivative(self.0);
        Zip::from(&mut dy).and(run.input(0)).and(run.output()).for_each(|d, &x, &y| *d *= derivative(x, y));
        run.give(0, dy);
    }

    fn lower(&self, to: &mut Lowering, inputs: &[ValueId], _: usize) -> BufferId {
        to.in_place(inputs[0], OpKind::Function(self.0), StepData::None)
    }
}

/// Returns the derivative of a function at `x` with the value `y`.
fn derivative(function: Function) -> fn(f32, f32) -> f32 {
    match function {
        Function::Relu => |x, _| if x > 0.0 { 1.0 } else { 0.0 },
        Function::Elu => |x, y| if x > 0.0 { 1.0 } else { y + 1.0 },
        Function::Silu => |x, y| {
            let s = math::sigmoid(x);
            s + y * (1.0 - s)
        },
        Function::Gelu => |x, y| {
            // Phi(x) + x phi(x); Phi is y / x away from zero.
            let phi = 0.398_942_3 * math::exp(-0.5 * x * x);
            let cumulative = if x.abs() > 1e-2 { y / x } else { 0.5 + 0.398_942_3 * x };
            cumulative + x * phi
        },
        Function::GeluTanh => |x, y| {
            let s = math::sigmoid(1.595_769 * (x + 0.044_715 * x * x * x));
            s + y * (1.0 - s) * 1.595_769 * (1.0 + 0.134_145 * x * x)
        },
        Function::Tanh => |_, y| 1.0 - y * y,
        Function::Sigmoid => |_, y| y * (1.0 - y),
        Function::Exp => |_, y| y,
        Function::Sin => |x, _| math::cos(x),
        Function::Cos => |x, _| -math::sin(x),
        Function::Softplus => |x, _| math::sigmoid(x),
        Function::Mish => |x, _| {
            let t = math::tanh(math::softplus(x));
            t + x * (1.0 - t * t) * math::sigmoid(x)
        },
    }
}
