use actq_kernels::image::OpKind;
use ndarray::Array2;

use crate::error::{Result, bail, ensure};
use crate::graph::lowering::{BufferId, Lowering, StepData};
use crate::graph::operation::{Backward, Forward, NodeState, Operation, Saved};
use crate::graph::syntax::{Keys, Syntax};
use crate::graph::values::{ValueId, WeightMatrix};

/// The sum of two inputs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Add;

impl Operation for Add {
    fn output_len(&self, _: &[WeightMatrix], inputs: &[usize]) -> Result<usize> {
        let &[len, other] = inputs else { bail!("takes two inputs, not {}", inputs.len()) };
        ensure!(other == len, "adds {other} values to {len}");
        Ok(len)
    }

    fn syntax() -> Vec<Syntax<Self>> {
        let read = |op: &mut dyn Keys| op.add_input("with").map(|()| Self);
        vec![Syntax { name: "add", keys: &["with"], read }]
    }

    fn forward(&self, run: &Forward<'_>, _: &mut NodeState) -> (Array2<f32>, Saved) {
        (run.input(0) + run.input(1), Saved::default())
    }

    fn backward(&self, run: &mut Backward<'_>, _: Saved, dy: Array2<f32>, _: &mut NodeState) {
        run.give(1, dy.clone());
        run.give(0, dy);
    }

    fn lower(&self, to: &mut Lowering, inputs: &[ValueId], _: usize) -> BufferId {
        let dst = to.private(inputs[0]);
        let with = to.place(inputs[1]);
        to.emit(OpKind::Add, to.whole(dst), Some(with), None, StepData::None);
        dst
    }
}
