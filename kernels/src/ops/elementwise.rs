//! Operations on the elements of vectors.

use crate::arch;
use crate::math::{Native, Real};

/// Computes `y = clamp((clamp(x, ±pre_clip) - mean) * scale, ±clip)`, up to the shortest length; an infinite clip does
/// nothing. `mean` and `scale` hold f32 bits. An x that is not finite gives NaN.
pub fn normalize(x: &[f32], mean: &[u32], scale: &[u32], pre_clip: f32, clip: f32, y: &mut [f32]) {
    arch::normalize(x, mean, scale, pre_clip, clip, y);
}

/// Computes `y += x`, up to the shorter length.
#[inline(never)]
pub fn add(x: &[f32], y: &mut [f32]) {
    in_pairs(x, y, |y, x| (Native::of(y) + Native::of(x)).get());
}

/// Computes `y *= x`, up to the shorter length.
#[inline(never)]
pub fn mul(x: &[f32], y: &mut [f32]) {
    in_pairs(x, y, |y, x| (Native::of(y) * Native::of(x)).get());
}

#[inline(always)]
fn in_pairs(x: &[f32], y: &mut [f32], of: impl Fn(f32, f32) -> f32) {
    let len = x.len().min(y.len());
    // Not by indexing, whose panic some builds keep.
    let (Some(x), Some(y)) = (x.get(..len), y.get_mut(..len)) else { return };
    let ((x, xs), (y, ys)) = (x.as_rchunks::<2>(), y.as_rchunks_mut::<2>());
    if let ([y], [x]) = (y, x) {
        *y = of(*y, *x);
    }
    for (y, x) in ys.iter_mut().zip(xs) {
        *y = [of(y[0], x[0]), of(y[1], x[1])];
    }
}

/// Copies `from` to `to`, up to the shorter length. The target does not use memcpy, which takes as much code as a
/// kernel.
pub(crate) fn copy(from: &[u32], to: &mut [u32]) {
    arch::copy(from, to);
}

/// Copies little-endian words of the image as [`copy`] does.
pub(crate) fn copy_le(from: &[u32], to: &mut [u32]) {
    copy(from, to);
    if cfg!(target_endian = "big") {
        to.iter_mut().for_each(|word| *word = u32::from_le(*word));
    }
}
