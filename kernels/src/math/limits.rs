//! Limits, and values outside the range of f32.

use core::ops::RangeInclusive;

use super::real::Real;

/// Squared lengths of a quaternion that is an orientation: lengths from 0.906 to 1.095.
///
/// Sensors send unit quaternions. Rounding to int16 changes their length by less than 0.1 %, a filter that does not
/// normalize by a few per cent. A message that is missing, half-written or in another unit is outside.
pub const ORIENTATION: RangeInclusive<f32> = 0.82..=1.2;

/// Limits `x` to `low ..= high`, without the panic of `f32::clamp`.
#[inline(always)]
pub fn clamp(x: f32, low: f32, high: f32) -> f32 {
    if x < low {
        low
    } else if x > high {
        high
    } else {
        x
    }
}

/// Returns 0 if `x` is finite, otherwise NaN: added to a result, it keeps an overflow visible.
#[inline(always)]
#[expect(clippy::eq_op, reason = "the difference of an infinity and itself is NaN")]
pub(crate) fn zero_or_nan<R: Real>(x: R) -> R {
    x - x
}
