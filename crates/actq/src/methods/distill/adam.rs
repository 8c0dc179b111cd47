//! Adam (arXiv 1412.6980).

use crate::numbers::power;

/// Adam's moments of a range of parameters.
#[derive(Clone, Debug)]
pub struct Adam {
    first: Vec<f32>,
    second: Vec<f32>,
}

const FIRST: f32 = 0.9;
const SECOND: f32 = 0.999;
/// Constant that keeps a parameter without a gradient unchanged.
const TINY: f32 = 1e-12;

/// Size of one step.
#[derive(Clone, Copy, Debug)]
pub struct Stride {
    rate: f32,
    /// Bias corrections of the moments after few steps.
    first: f32,
    second: f32,
}

impl Stride {
    /// Returns the stride of step `t`, which counts from 1.
    pub fn new(rate: f32, t: u32) -> Self {
        Self { rate, first: 1.0 / (1.0 - power(FIRST, t)), second: 1.0 / (1.0 - power(SECOND, t)) }
    }
}

impl Stride {
    /// Returns the stride with another rate.
    #[inline(always)]
    pub(super) fn times(self, factor: f32) -> Self {
        Self { rate: self.rate * factor, ..self }
    }
}

impl Adam {
    /// Makes moments of `len` parameters.
    pub fn new(len: usize) -> Self {
        Self { first: vec![0.0; len], second: vec![0.0; len] }
    }

    /// Moves `parameters` along `grads`.
    pub fn step(&mut self, parameters: &mut [f32], grads: &[f32], stride: Stride) {
        step(parameters, grads, Moments { first: &mut self.first, second: &mut self.second }, stride);
    }

    /// As [`Self::step`], with strides in units of each parameter's own.
    pub(super) fn step_in_units(
        &mut self,
        parameters: &mut [f32],
        grads: &[f32],
        units: Option<&[f32]>,
        stride: Stride,
    ) {
        let Some(units) = units else { return self.step(parameters, grads, stride) };
        let parameters = parameters.chunks_mut(1).zip(grads.chunks(1)).zip(self.chunks(1));
        for (((parameter, grad), moments), unit) in parameters.zip(units) {
            step(parameter, grad, moments, stride.times(*unit));
        }
    }

    /// Returns the moments of `len` parameters at a time.
    pub(super) fn chunks(&mut self, len: usize) -> impl Iterator<Item = Moments<'_>> {
        let pairs = self.first.chunks_mut(len).zip(self.second.chunks_mut(len));
        pairs.map(|(first, second)| Moments { first, second })
    }
}

/// Moments of a part of the parameters.
#[derive(Debug)]
pub(super) struct Moments<'a> {
    pub(super) first: &'a mut [f32],
    pub(super) second: &'a mut [f32],
}

/// Does [`Adam::step`] on a part of the parameters.
#[inline(always)]
pub(super) fn step(parameters: &mut [f32], grads: &[f32], moments: Moments<'_>, stride: Stride) {
    let moments = moments.first.iter_mut().zip(moments.second);
    for ((p, g), (m, v)) in parameters.iter_mut().zip(grads).zip(moments) {
        *m = FIRST * *m + (1.0 - FIRST) * g;
        *v = SECOND * *v + (1.0 - SECOND) * g * g;
        *p -= stride.rate * *m * stride.first / ((*v * stride.second).sqrt() + TINY);
    }
}
