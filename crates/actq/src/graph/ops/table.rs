use actq_kernels::image::OpKind;
use ndarray::Array2;

use crate::error::{Result, ensure};
use crate::graph::lowering::{BufferId, Lifetime, Lowering, StepData};
use crate::graph::operation::{Backward, Elements, Forward, NodeState, Operation, Saved};
use crate::graph::units::keep;
use crate::graph::values::{ValueId, WeightMatrix};

/// Constants that differ between denoising steps: the network's values of the time.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// One row per step, in order.
    pub rows: Vec<f32>,
    /// Values of a row.
    pub len: usize,
}

impl Operation for Table {
    fn output_len(&self, _: &[WeightMatrix], inputs: &[usize]) -> Result<usize> {
        ensure!(inputs.is_empty(), "takes no input, not {}", inputs.len());
        ensure!(
            self.len > 0 && self.rows.len().is_multiple_of(self.len),
            "{} values in rows of {}",
            self.rows.len(),
            self.len
        );
        Ok(self.len)
    }

    learned! { rows }

    fn keep_units(&mut self, len: usize, units: &[usize]) {
        keep(&mut self.rows, len, units);
        self.len = units.len();
    }

    fn elements(&self) -> Elements {
        Elements::Own
    }

    fn forward(&self, run: &Forward<'_>, _: &mut NodeState) -> (Array2<f32>, Saved) {
        let row = &run.vectors[0][run.step * self.len..][..self.len];
        (Array2::from_shape_fn((run.samples(), self.len), |(_, i)| row[i]), Saved::default())
    }

    fn backward(&self, run: &mut Backward<'_>, _: Saved, dy: Array2<f32>, _: &mut NodeState) {
        let sums = &mut run.d_vectors[0][run.step * self.len..][..self.len];
        for row in dy.rows() {
            sums.iter_mut().zip(row).for_each(|(sum, d)| *sum += d);
        }
    }

    fn lower(&self, to: &mut Lowering, _: &[ValueId], len: usize) -> BufferId {
        let dst = to.buffer(len, Lifetime::Step);
        to.emit(OpKind::Table, to.whole(dst), None, None, StepData::Constants(self.rows.clone()));
        dst
    }
}
