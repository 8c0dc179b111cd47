use std::ops::Range;

use actq_kernels::image::OpKind;
use ndarray::Array2;

use crate::error::Result;
use crate::graph::lowering::{BufferId, Lifetime, Lowering, Slice, StepData};
use crate::graph::operation::{Backward, Forward, NodeState, Operation, Saved, expect_len, only};
use crate::graph::syntax::{Keys, Syntax, required};
use crate::graph::units::keep;
use crate::graph::values::{ValueId, WeightMatrix};
use crate::numbers::limit;

/// `clamp((clamp(x, ±pre_clip) - mean) * scale, ±clip)`
#[derive(Clone, Debug, PartialEq)]
pub struct Normalize {
    /// Means.
    pub mean: Vec<f32>,
    /// Factors.
    pub scale: Vec<f32>,
    /// Limit before the normalization, or infinity.
    pub pre_clip: f32,
    /// Limit after the normalization, or infinity.
    pub clip: f32,
}

impl Operation for Normalize {
    fn output_len(&self, _: &[WeightMatrix], inputs: &[usize]) -> Result<usize> {
        let len = only(inputs)?;
        expect_len("mean", &self.mean, len)?;
        expect_len("scale", &self.scale, len)?;
        Ok(len)
    }

    fn syntax() -> Vec<Syntax<Self>> {
        let read = |op: &mut dyn Keys| {
            let len = op.input_len();
            Ok(Self {
                mean: required(op.vector("mean", len)?, "mean")?,
                scale: required(op.vector("scale", len)?, "scale")?,
                pre_clip: limit(op.number("pre_clip")?, "pre_clip")?,
                clip: limit(op.number("clip")?, "clip")?,
            })
        };
        vec![Syntax { name: "normalize", keys: &["mean", "scale", "pre_clip", "clip"], read }]
    }

    fn keep_units(&mut self, len: usize, units: &[usize]) {
        keep(&mut self.mean, len, units);
        keep(&mut self.scale, len, units);
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

    fn backward(&self, run: &mut Backward<'_>, _: Saved, mut dy: Array2<f32>, _: &mut NodeState) {
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
        self.emit(to, inputs, len)
    }
}

impl Normalize {
    /// Appends the operation, as [`Operation::lower`].
    fn emit(&self, to: &mut Lowering, inputs: &[ValueId], len: usize) -> BufferId {
        let (dst, src) = (to.buffer(len, Lifetime::Step), to.place(inputs[0]));
        self.emit_run(false, to, dst, src, 0..len);
        dst
    }

    /// Emits the operation on a run of the values.
    fn emit_run(&self, added: bool, to: &mut Lowering, dst: BufferId, src: Slice, run: Range<usize>) {
        let part = |of: Slice| Slice { offset: of.offset + run.start, len: run.len(), ..of };
        let (dst, src) = (part(to.whole(dst)), part(src));
        let (mean, scale) = (&self.mean[run.clone()], &self.scale[run]);
        let data = StepData::Constants([&[self.pre_clip, self.clip], mean, scale].concat());
        to.emit(OpKind::Normalize { added }, dst, Some(src), None, data);
    }
}

/// `(x - mean) * scale` of all values or of runs of them; the quantizer adds it before matrices whose columns it has
/// scaled. The other values stay as they are.
#[derive(Clone, Debug, PartialEq)]
pub struct Balance {
    /// Of the other values, the mean is 0 and the scale 1.
    normalize: Normalize,
    /// Ascending, with a gap between two.
    runs: Vec<Range<usize>>,
    /// `true` if the image holds the means; without, all of them are 0.
    has_means: bool,
}

impl Balance {
    /// The `eps` of the RMS norm that multiplies if the image holds no means: 2^120, whose root is a power of two. The
    /// squares of values up to 2^47 vanish beside it.
    pub const FREE_EPS: f32 = f32::from_bits((127 + 120) << 23);

    /// Makes a balance with these means and factors.
    pub fn new(mean: Vec<f32>, scale: Vec<f32>) -> Self {
        let all = 0..mean.len();
        Self::of_runs(Some(mean), scale, vec![all])
    }

    /// Makes a balance with means, or without, and factors, of which only those of `runs` count.
    pub fn of_runs(mean: Option<Vec<f32>>, mut scale: Vec<f32>, runs: Vec<Range<usize>>) -> Self {
        let has_means = mean.is_some();
        let mut mean = mean.unwrap_or_else(|| vec![0.0; scale.len()]);
        let other = |i: &usize| !runs.iter().any(|run| run.contains(i));
        for i in (0..mean.len().min(scale.len())).filter(other) {
            (mean[i], scale[i]) = (0.0, 1.0);
        }
        let normalize = Normalize { mean, scale, pre_clip: f32::INFINITY, clip: f32::INFINITY };
        Self { normalize, runs, has_means }
    }

    /// Returns the bytes of the constants for a run of `len` values: means, scales, and the operation's two limits.
    pub const fn bytes(len: usize) -> usize {
        4 * (2 * len + 2)
    }

    /// Returns the same without means: scales and `eps`.
    pub const fn bytes_without_means(len: usize) -> usize {
        4 * (len + 1)
    }

    /// Returns the bytes of its constants.
    pub fn constant_bytes(&self) -> usize {
        let bytes = if self.has_means { Self::bytes } else { Self::bytes_without_means };
        self.runs.iter().map(|run| bytes(run.len())).sum()
    }

    /// Returns the normalization that it computes.
    pub fn normalize(&self) -> &Normalize {
        &self.normalize
    }
}

impl Operation for Balance {
    fn output_len(&self, matrices: &[WeightMatrix], inputs: &[usize]) -> Result<usize> {
        self.normalize.output_len(matrices, inputs)
    }

    fn keep_units(&mut self, len: usize, units: &[usize]) {
        self.normalize.keep_units(len, units);
        let scaled: Vec<bool> = units.iter().map(|unit| self.runs.iter().any(|run| run.contains(unit))).collect();
        let mut start = 0;
        self.runs.clear();
        for of_one in scaled.chunk_by(|a, b| a == b) {
            let end = start + of_one.len();
            if of_one[0] {
                self.runs.push(start..end);
            }
            start = end;
        }
    }

    fn forward(&self, run: &Forward<'_>, state: &mut NodeState) -> (Array2<f32>, Saved) {
        self.normalize.forward(run, state)
    }

    fn backward(&self, run: &mut Backward<'_>, saved: Saved, dy: Array2<f32>, d_state: &mut NodeState) {
        self.normalize.backward(run, saved, dy, d_state);
    }

    fn lower(&self, to: &mut Lowering, inputs: &[ValueId], len: usize) -> BufferId {
        let (dst, src) = (to.buffer(len, Lifetime::Step), to.place(inputs[0]));
        if !self.has_means || self.runs.iter().map(Range::len).sum::<usize>() < len {
            to.emit(OpKind::Copy, to.whole(dst), Some(src), None, StepData::None);
        }
        for run in &self.runs {
            if self.has_means {
                self.normalize.emit_run(true, to, dst, src, run.clone());
                continue;
            }
            let root = Self::FREE_EPS.sqrt();
            let weights = self.normalize.scale[run.clone()].iter().map(|scale| scale * root);
            let data = StepData::Constants([Self::FREE_EPS].into_iter().chain(weights).collect());
            to.emit(OpKind::RmsNorm, Slice { offset: run.start, len: run.len(), ..to.whole(dst) }, None, None, data);
        }
        dst
    }
}
