//! Normalizations.

use crate::math::clamp;

/// `y = clamp((clamp(x, ±pre_clip) - mean) * scale, ±clip)`; an infinite clip does nothing. `mean` and `scale` hold f32 bits.
pub fn normalize(x: &[f32], mean: &[u32], scale: &[u32], pre_clip: f32, clip: f32, y: &mut [f32]) {
    for (((y, x), &mean), &scale) in y.iter_mut().zip(x).zip(mean).zip(scale) {
        let x = clamp(*x, -pre_clip, pre_clip);
        let z = (x - constant(mean)) * constant(scale);
        *y = clamp(z, -clip, clip);
    }
}

/// In place `(x - mean) / sqrt(variance + eps) * weight + bias`, mean and biased variance over the vector (torch's LayerNorm).
/// Sums run in order from the first element.
pub fn layer_norm(x: &mut [f32], weight: &[u32], bias: &[u32], eps: f32) {
    let n = x.len().max(1) as f32;
    let mean = x.iter().fold(0.0, |sum, v| sum + v) / n;
    let variance = x.iter().fold(0.0, |sum, v| sum + (v - mean) * (v - mean)) / n;
    let inverse = 1.0 / libm::sqrtf(variance + eps);
    for ((x, &weight), &bias) in x.iter_mut().zip(weight).zip(bias) {
        *x = (*x - mean) * inverse * constant(weight) + constant(bias);
    }
}

/// In place `x / sqrt(mean(x^2) + eps) * weight`.
pub fn rms_norm(x: &mut [f32], weight: &[u32], eps: f32) {
    let n = x.len().max(1) as f32;
    let mean_square = x.iter().fold(0.0, |sum, v| sum + v * v) / n;
    let inverse = 1.0 / libm::sqrtf(mean_square + eps);
    for (x, &weight) in x.iter_mut().zip(weight) {
        *x = *x * inverse * constant(weight);
    }
}

/// An f32 constant as it stands in the image.
#[inline(always)]
fn constant(bits: u32) -> f32 {
    f32::from_bits(u32::from_le(bits))
}
