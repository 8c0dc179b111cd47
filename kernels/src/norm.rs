//! Normalizations, and sums of vectors.

use crate::math::clamp;

/// `y = clamp((clamp(x, ±pre_clip) - mean) * scale, ±clip)`; an infinite clip does nothing. `mean` and `scale` hold f32 bits.
#[inline(never)]
pub fn normalize(x: &[f32], mean: &[u32], scale: &[u32], pre_clip: f32, clip: f32, y: &mut [f32]) {
    for (((y, x), &mean), &scale) in y.iter_mut().zip(x).zip(mean).zip(scale) {
        let x = clamp(*x, -pre_clip, pre_clip);
        let z = (x - constant(mean)) * constant(scale);
        *y = clamp(z, -clip, clip);
    }
}

/// In place `(x - mean) / sqrt(variance + eps) * weight + bias`, mean and biased variance over the vector (torch's LayerNorm).
/// Sums run in order from the first element.
#[inline(never)]
pub fn layer_norm(x: &mut [f32], weight: &[u32], bias: &[u32], eps: f32) {
    let mean = sum(x, |v| v) / count(x);
    let inverse = inverse_deviation(x, mean, eps);
    let apply = |x: &mut f32, weight: u32, bias: u32| *x = (*x - mean) * inverse * constant(weight) + constant(bias);
    let (Some(weight), Some(bias)) = (weight.get(..x.len()), bias.get(..x.len())) else { return };
    let ((odd, pairs), (weight, weights), (bias, biases)) =
        (x.as_rchunks_mut::<2>(), weight.as_rchunks::<2>(), bias.as_rchunks::<2>());
    if let ([x], [weight], [bias]) = (odd, weight, bias) {
        apply(x, *weight, *bias);
    }
    for ((x, weight), bias) in pairs.iter_mut().zip(weights).zip(biases) {
        apply(&mut x[0], weight[0], bias[0]);
        apply(&mut x[1], weight[1], bias[1]);
    }
}

/// In place `x / sqrt(mean(x^2) + eps) * weight`.
#[inline(never)]
pub fn rms_norm(x: &mut [f32], weight: &[u32], eps: f32) {
    let inverse = inverse_deviation(x, 0.0, eps);
    for (x, &weight) in x.iter_mut().zip(weight) {
        *x = *x * inverse * constant(weight);
    }
}

/// `1 / sqrt(mean((x - center)^2) + eps)`
#[inline(never)]
fn inverse_deviation(x: &[f32], center: f32, eps: f32) -> f32 {
    let squares = sum(x, |v| (v - center) * (v - center));
    1.0 / sqrt(squares / count(x) + eps)
}

/// `y += x`, as far as both go.
#[inline(never)]
pub fn add(x: &[f32], y: &mut [f32]) {
    let len = x.len().min(y.len());
    let ((x, xs), (y, ys)) = (x[..len].as_rchunks::<2>(), y[..len].as_rchunks_mut::<2>());
    if let ([y], [x]) = (y, x) {
        *y += *x;
    }
    for (y, x) in ys.iter_mut().zip(xs) {
        *y = [y[0] + x[0], y[1] + x[1]];
    }
}

fn count(x: &[f32]) -> f32 {
    x.len().max(1) as f32
}

/// The sum in order from the first element, four in a pass.
#[inline(always)]
fn sum(x: &[f32], of: impl Fn(f32) -> f32) -> f32 {
    let (rest, fours) = x.as_rchunks::<4>();
    let sum = rest.iter().fold(0.0, |sum, v| sum + of(*v));
    fours.iter().fold(sum, |sum, [a, b, c, d]| sum + of(*a) + of(*b) + of(*c) + of(*d))
}

/// The square root, correctly rounded on every machine.
#[inline(always)]
fn sqrt(x: f32) -> f32 {
    #[cfg(actq_fpu)]
    return crate::armv7em::sqrt(x);
    #[cfg(not(actq_fpu))]
    libm::sqrtf(x)
}

/// An f32 constant as it stands in the image.
#[inline(always)]
fn constant(bits: u32) -> f32 {
    f32::from_bits(u32::from_le(bits))
}
