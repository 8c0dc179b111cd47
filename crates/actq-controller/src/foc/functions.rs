//! Sine, cosine, arctangent and inverse root with the accuracy that a current loop needs.
//!
//! An angle sensor has an error of a few tenths of an electrical degree; a current sensor has one step of a 12-bit ADC
//! and a percent of gain. So an angle may be wrong by a quarter of a degree, which turns 0.44 % of the current into the
//! other axis. A current may be wrong by one step of the ADC, and the voltage limit by half a percent. Among the
//! functions of libm, micromath and the kernels within these errors, each one here takes a Cortex-M4 the fewest cycles.
//! `host-tests/tests/all/on_target/foc.rs` asserts it (figures: `docs/records/2026-11-24-foc.md`):
//!
//! | function | source | worst error |
//! |---|---|---|
//! | [`sin_cos`] | micromath, with a step of Newton's method for the length | 0.068 degrees; length 1 within 2e-6 |
//! | [`atan2`] | micromath | 0.163 degrees |
//! | [`inverse_root_below`] | micromath, with a step of Newton's method | 0.176 % below |
//!
//! micromath's functions are called on its type [`F32`]. The methods of its trait for f32 have the names of std's
//! methods. Which of them a call selects would depend on whether std is linked, and so would the bits.

use micromath::F32;

/// Largest magnitude of an angle, in radians: up to it, rounding costs less than a hundredth of a degree.
pub const MAX_RADIANS: f32 = 1000.0;

/// Returns the sine and cosine of an angle within [`MAX_RADIANS`] of 0.
pub fn sin_cos(radians: f32) -> (f32, f32) {
    let (sin, cos) = (F32(radians).sin().0, F32(radians).cos().0);
    // Each has an error of up to 0.0012, as does the length of their vector, which would scale the current.
    let scale = newton(sin * sin + cos * cos, 1.0);
    (sin * scale, cos * scale)
}

/// Returns the angle of a vector of finite length, in radians from -pi to pi.
pub fn atan2(y: f32, x: f32) -> f32 {
    F32(y).atan2(F32(x)).0
}

/// Returns the inverse root of a finite, non-negative number. It exceeds the exact one only by rounding. The result for
/// 0 is finite.
pub fn inverse_root_below(square: f32) -> f32 {
    newton(square, F32(square).invsqrt().0)
}

/// Refines a positive estimate of the inverse root of `square` by one step of Newton's method. The result does not
/// exceed the inverse root, where y (3 - square y^2) / 2 has its maximum.
fn newton(square: f32, estimate: f32) -> f32 {
    estimate * (1.5 - 0.5 * square * estimate * estimate)
}
