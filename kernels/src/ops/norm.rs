//! Norms over a vector.

use core::ops::Range;

use crate::arch::{sqrt, standardize, sum, sum_squares};
use crate::cursor::Moments;
use crate::math::{Native, Real, zero_or_nan};

/// Computes in place `(x - mean) / sqrt(variance + eps) * weight + bias`, with mean and biased variance over the vector
/// (torch's LayerNorm). Sums run in order from the first element. It does nothing if there are too few weights or
/// biases.
pub fn layer_norm(x: &mut [f32], weight: &[u32], bias: &[u32], eps: f32) {
    layer_norm_units(0..3 * x.len(), &mut Moments::default(), x, weight, bias, eps);
}

/// Computes some units of a layer norm: one pass over the elements for their sum, one for the squares, one for the
/// results.
#[inline(never)]
pub(crate) fn layer_norm_units(
    units: Range<usize>,
    moments: &mut Moments,
    x: &mut [f32],
    weight: &[u32],
    bias: &[u32],
    eps: f32,
) {
    let [summed, squared, normed] = [0, 1, 2].map(|pass| elements(&units, pass, x.len()));
    moments.sum = sum(moments.sum, x.get(summed).unwrap_or(&[]));
    let mean = moments.sum / count(x);
    let inverse = inverse_deviation(moments, x, squared, mean, eps);
    let (Some(weight), Some(bias)) = (weight.get(normed.clone()), bias.get(normed.clone())) else { return };
    standardize(mean, inverse, x.get_mut(normed).unwrap_or_default(), weight, bias);
}

/// Computes in place `x / sqrt(mean(x^2) + eps) * weight`. It does nothing if there are too few weights.
pub fn rms_norm(x: &mut [f32], weight: &[u32], eps: f32) {
    rms_norm_units(0..2 * x.len(), &mut Moments::default(), x, weight, eps);
}

/// Computes some units of an RMS norm: one pass over the elements for the squares, one for the results.
#[inline(never)]
pub(crate) fn rms_norm_units(units: Range<usize>, moments: &mut Moments, x: &mut [f32], weight: &[u32], eps: f32) {
    let [squared, normed] = [0, 1].map(|pass| elements(&units, pass, x.len()));
    let inverse = inverse_deviation(moments, x, squared, 0.0, eps);
    let Some(weight) = weight.get(normed.clone()) else { return };
    for (x, &weight) in x.get_mut(normed).unwrap_or_default().iter_mut().zip(weight) {
        let weight = Native::of(f32::from_bits(u32::from_le(weight)));
        *x = (Native::of(*x) * Native::of(inverse) * weight).get();
    }
}

/// Returns the elements of pass `pass` over a vector that are among `units` of all passes.
fn elements(units: &Range<usize>, pass: usize, len: usize) -> Range<usize> {
    let of_pass = |unit: usize| unit.saturating_sub(pass * len).min(len);
    of_pass(units.start)..of_pass(units.end)
}

/// Adds the squares of some elements; returns `1 / sqrt(mean((x - center)^2) + eps)`, which is valid after all of them.
#[inline(never)]
fn inverse_deviation(moments: &mut Moments, x: &[f32], squared: Range<usize>, center: f32, eps: f32) -> f32 {
    moments.squares = sum_squares(moments.squares, center, x.get(squared).unwrap_or(&[]));
    // A vector divided by an infinite deviation would be zeros.
    1.0 / sqrt(moments.squares / count(x) + eps) + zero_or_nan(moments.squares)
}

fn count(x: &[f32]) -> f32 {
    x.len().max(1) as f32
}
