//! Elementwise operations with limits.

use crate::math::{Native, Real};

/// Computes [`crate::ops::denoise::denoise`]; `by` holds its coefficients in their order.
#[inline(never)]
pub fn denoise(by: &[f32; 7], limit: f32, v: &[f32], z: &[f32], x: &mut [f32], y: &mut [f32]) {
    let is_limited = by[0] != 0.0 || by[1] != 0.0;
    let [sample_x, sample_v, keep, direct, sample, sigma, ahead] = by.map(Native::of);
    let next = |x: &f32, v: Native| {
        let x = Native::of(*x);
        let straight = keep * x + direct * v;
        if is_limited { straight + sample * limited(sample_x * x + sample_v * v, limit) } else { straight }
    };
    let elements = x.iter_mut().zip(y).zip(v);
    if z.is_empty() {
        for ((x, y), v) in elements {
            let v = Native::of(*v);
            let iterate = next(x, v);
            *x = iterate.get();
            *y = (iterate + ahead * v).get();
        }
    } else {
        for (((x, y), v), z) in elements.zip(z) {
            *x = (next(x, Native::of(*v)) + sigma * Native::of(*z)).get();
            *y = *x;
        }
    }
}

/// Computes [`crate::ops::elementwise::normalize`].
#[inline(never)]
pub fn normalize(x: &[f32], mean: &[u32], scale: &[u32], pre_clip: f32, clip: f32, y: &mut [f32]) {
    let constant = |bits: &u32| Native::of(f32::from_bits(u32::from_le(*bits)));
    for (((y, x), mean), scale) in y.iter_mut().zip(x).zip(mean).zip(scale) {
        let x = Native::of(*x);
        let z = (limited(x, pre_clip) - constant(mean)) * constant(scale);
        *y = (limited(z, clip) + Native::of(0.0) * x).get();
    }
}

/// Limits `x` to `±limit`. If infinities made it NaN, whose sign differs between machines, it is the limit.
#[inline(always)]
fn limited<R: Real>(x: R, limit: f32) -> R {
    if R::of(-x.get()).is_above(limit) {
        R::of(-limit)
    } else if x.is_above(limit) || x.get().to_bits() << 1 > f32::INFINITY.to_bits() << 1 {
        R::of(limit)
    } else {
        x
    }
}
