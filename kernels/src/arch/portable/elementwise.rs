//! Elementwise operations with limits.

/// Computes [`crate::ops::denoise::denoise`]; `by` holds its coefficients in their order.
#[inline(never)]
pub fn denoise(by: &[f32; 7], limit: f32, v: &[f32], z: &[f32], x: &mut [f32], y: &mut [f32]) {
    let &[sample_x, sample_v, keep, direct, sample, sigma, ahead] = by;
    let is_limited = sample_x != 0.0 || sample_v != 0.0;
    let next = |x: f32, v: f32| {
        let straight = keep * x + direct * v;
        if is_limited { straight + sample * limited(sample_x * x + sample_v * v, limit) } else { straight }
    };
    let elements = x.iter_mut().zip(y).zip(v);
    if z.is_empty() {
        for ((x, y), &v) in elements {
            *x = next(*x, v);
            *y = *x + ahead * v;
        }
    } else {
        for (((x, y), &v), &z) in elements.zip(z) {
            *x = next(*x, v) + sigma * z;
            *y = *x;
        }
    }
}

/// Computes [`crate::ops::elementwise::normalize`].
#[inline(never)]
pub fn normalize(x: &[f32], mean: &[u32], scale: &[u32], pre_clip: f32, clip: f32, y: &mut [f32]) {
    let constant = |bits: &u32| f32::from_bits(u32::from_le(*bits));
    for (((y, &x), mean), scale) in y.iter_mut().zip(x).zip(mean).zip(scale) {
        let z = (limited(x, pre_clip) - constant(mean)) * constant(scale);
        *y = limited(z, clip) + 0.0 * x;
    }
}

/// Limits `x` to `±limit`. If infinities made it NaN, whose sign differs between machines, it is the limit.
#[inline(always)]
fn limited(x: f32, limit: f32) -> f32 {
    if x < -limit {
        -limit
    } else if x <= limit {
        x
    } else {
        limit
    }
}
