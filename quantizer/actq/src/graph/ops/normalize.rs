use actq_kernels::image::OpKind;
use ndarray::Array2;

use crate::error::Result;
use crate::graph::lowering::{BufferId, Lifetime, Lowering, StepData};
use crate::graph::operation::{Backward, Forward, NodeState, Operation, Saved, expect_len, only};
use crate::graph::values::{ValueId, WeightMatrix};

/// `clamp((clamp(x, ±pre_clip) - mean) * scale, ±clip)`
#[derive(Clone, Debug)]
pub struct Normalize {
    /// Means.
    pub mean: Vec<f32>,
    /// Factors.
    pub scale: Vec<f32>,
    /// Limit before, or infinity.
    pub pre_clip: f32,
    /// Limit after, or infinity.
    pub clip: f32,
}

impl Operation for Normalize {
    fn output_len(&self, _: &[WeightMatrix], inputs: &[usize]) -> Result<usize> {
        let len = only(inputs)?;
        expect_len("mean", &self.mean, len)?;
        expect_len("scale", &self.scale, len)?;
        Ok(len)
    }

    fn forward(&self, run: &Forward<'_>, _: &mut NodeState) -> (Array2<f32>, Saved) {
        let Self { mean, scale, pre_clip, clip } = self;
        let mut y = run.input(0).clone();
        for mut row in y.rows_mut() {
            for (y, (m, s)) in row.iter_mut().zip(mean.iter().zip(scale)) {
                *y = ((y.clamp(-pre_clip, *pre_clip) - m) * s).clamp(-clip, *clip);
            }
        }
        (y, Saved::default())
    }

    fn backward(&self, run: &mut Backward<'_>, _: &Saved, mut dy: Array2<f32>, _: &mut NodeState) {
        let Self { mean, scale, pre_clip, clip } = self;
        for (mut d, x) in dy.rows_mut().into_iter().zip(run.input(0).rows()) {
            for ((d, x), (m, s)) in d.iter_mut().zip(x).zip(mean.iter().zip(scale)) {
                let inside = x.abs() < *pre_clip && ((x - m) * s).abs() < *clip;
                *d = if inside { *d * s } else { 0.0 };
            }
        }
        run.give(0, dy);
    }

    fn lower(&self, to: &mut Lowering, inputs: &[ValueId], len: usize) -> BufferId {
        self.emit(false, to, inputs, len)
    }
}

impl Normalize {
    /// As [`Operation::lower`].
    fn emit(&self, added: bool, to: &mut Lowering, inputs: &[ValueId], len: usize) -> BufferId {
        let dst = to.buffer(len, Lifetime::Step);
        let src = to.place(inputs[0]);
        let data = StepData::Constants([&[self.pre_clip, self.clip], &self.mean[..], &self.scale].concat());
        to.emit(OpKind::Normalize { added }, to.whole(dst), Some(src), None, data);
        dst
    }
}

/// `(x - mean) * scale`, which the quantizer puts before matrices whose columns it has scaled.
#[derive(Clone, Debug)]
pub struct Balance(Normalize);

impl Balance {
    /// With these means and factors.
    pub fn new(mean: Vec<f32>, scale: Vec<f32>) -> Self {
        Self(Normalize { mean, scale, pre_clip: f32::INFINITY, clip: f32::INFINITY })
    }

    /// Bytes of the constants for so many values: means, scales, and the operation's two limits.
    pub fn bytes(len: usize) -> usize {
        4 * (2 * len + 2)
    }

    /// What it computes.
    pub fn normalize(&self) -> &Normalize {
        &self.0
    }
}

impl Operation for Balance {
    fn output_len(&self, matrices: &[WeightMatrix], inputs: &[usize]) -> Result<usize> {
        self.0.output_len(matrices, inputs)
    }

    fn forward(&self, run: &Forward<'_>, state: &mut NodeState) -> (Array2<f32>, Saved) {
        self.0.forward(run, state)
    }

    fn backward(&self, run: &mut Backward<'_>, saved: &Saved, dy: Array2<f32>, d_state: &mut NodeState) {
        self.0.backward(run, saved, dy, d_state);
    }

    fn lower(&self, to: &mut Lowering, inputs: &[ValueId], len: usize) -> BufferId {
        self.0.emit(true, to, inputs, len)
    }
}
