//! The passes of a norm: see [`crate::ops::norm`].

use crate::math::{Native, Real};

/// Adds the elements of `x` to `start`, in order.
pub fn sum(start: f32, x: &[f32]) -> f32 {
    x.iter().fold(Native::of(start), |sum, v| sum + Native::of(*v)).get()
}

/// Adds the squared differences of `x` from `center` to `start`, in order.
pub fn sum_squares(start: f32, center: f32, x: &[f32]) -> f32 {
    let of = |v: &f32| Native::of(*v) - Native::of(center);
    x.iter().map(of).fold(Native::of(start), |sum, v| sum + v * v).get()
}

/// Computes in place `(x - mean) * inverse * weight + bias`, up to the shortest length.
pub fn standardize(mean: f32, inverse: f32, x: &mut [f32], weight: &[u32], bias: &[u32]) {
    for ((x, weight), bias) in x.iter_mut().zip(weight).zip(bias) {
        let [weight, bias] = [weight, bias].map(|bits| Native::of(f32::from_bits(u32::from_le(*bits))));
        *x = ((Native::of(*x) - Native::of(mean)) * Native::of(inverse) * weight + bias).get();
    }
}
