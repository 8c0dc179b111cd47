use ndarray::Array2;

use crate::error::{Result, ensure};
use crate::graph::lowering::{BufferId, Lowering};
use crate::graph::operation::{Backward, Elements, Forward, NodeState, Operation, Saved};
use crate::graph::values::{ValueId, WeightMatrix};

/// The value that the network reads of the iterate of a flow or a diffusion process: noise at first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iterate {
    /// Values.
    pub len: usize,
}

impl Operation for Iterate {
    fn output_len(&self, _: &[WeightMatrix], inputs: &[usize]) -> Result<usize> {
        ensure!(inputs.is_empty(), "takes no input, not {}", inputs.len());
        Ok(self.len)
    }

    fn elements(&self) -> Elements {
        Elements::Whole
    }

    fn forward(&self, run: &Forward<'_>, _: &mut NodeState) -> (Array2<f32>, Saved) {
        (run.iterate().clone(), Saved::default())
    }

    fn backward(&self, run: &mut Backward<'_>, _: Saved, dy: Array2<f32>, _: &mut NodeState) {
        run.give_iterate(dy);
    }

    fn lower(&self, to: &mut Lowering, _: &[ValueId], _: usize) -> BufferId {
        to.iterate()
    }
}
