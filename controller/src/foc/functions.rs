//! Sine, cosine, arctangent and inverse root, as exact as a current loop needs them.
//!
//! A sensor of the angle has a few tenths of an electrical degree, one of the current a step of a 12-bit ADC and a percent
//! of gain. So an angle may be off by a quarter of a degree, which turns 0.44 % of the current into the other axis, a
//! current by a step of the ADC, and the limit of the voltage by half a percent. Of the functions of libm, micromath and
//! the kernels that keep to it, each is the one that takes a Cortex-M4 the fewest cycles, which
//! `host-tests/tests/all/on_target/foc.rs` asserts (figures: `docs/records/2026-11-24-foc.md`):
//!
//! | function | of | worst error |
//! |---|---|---|
//! | [`sin_cos`] | micromath, with a step of Newton's method for the length | 0.068 degrees; length 1 within 2e-6 |
//! | [`atan2`] | micromath | 0.163 degrees |
//! | [`inverse_root_below`] | micromath, with a step of Newton's method | 0.176 % below |
//!
//! micromath's functions are called on its type [`F32`]. The methods of its trait for f32 have the names of std's, and
//! which are called would depend on whether std is linked: not the same bits everywhere.

use micromath::F32;

/// The largest angle on either side of 0, in radians: up to it, rounding costs less than a hundredth of a degree.
pub const MOST_RADIANS: f32 = 1000.0;

/// Sine and cosine of an angle within [`MOST_RADIANS`].
pub fn sin_cos(radians: f32) -> (f32, f32) {
    let (sin, cos) = (F32(radians).sin().0, F32(radians).cos().0);
    // Each is off by up to 0.0012, and so is their vector's length, by which the current would be off, too.
    let scale = newton(sin * sin + cos * cos, 1.0);
    (sin * scale, cos * scale)
}

/// The angle of a vector of finite length, in radians from -pi to pi.
pub fn atan2(y: f32, x: f32) -> f32 {
    F32(y).atan2(F32(x)).0
}

/// The inverse root of a finite number that is not below 0; above the exact one only by rounding. That of 0 is finite,
/// too.
pub fn inverse_root_below(square: f32) -> f32 {
    newton(square, F32(square).invsqrt().0)
}

/// A step of Newton's method towards the inverse root of `square` from an estimate above 0. The result is not above the
/// inverse root, where y (3 - square y^2) / 2 has its maximum.
fn newton(square: f32, estimate: f32) -> f32 {
    estimate * (1.5 - 0.5 * square * estimate * estimate)
}
