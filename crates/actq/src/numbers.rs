//! Conversion of numbers to f32, and powers with the same bits on every platform.

use crate::error::{Result, ensure};

/// Returns the f64 of an f32's shortest decimal text: the number that a user wrote.
pub fn decimal(value: f32) -> f64 {
    format!("{value:?}").parse().unwrap_or(f64::from(value))
}

/// Rounds a number to f32, and refuses values beyond its range.
pub fn real(value: f64, name: &str) -> Result<f32> {
    let real = value as f32;
    ensure!(real.is_finite(), "{name} is {value:?}, beyond float32's range");
    Ok(real)
}

/// Rounds a limit to f32 as [`positive`] does; without one, returns infinity.
pub fn limit(value: Option<f64>, name: &str) -> Result<f32> {
    value.map_or(Ok(f32::INFINITY), |value| positive(value, name))
}

/// Rounds a number to f32 as [`real`] does, and refuses values that are not above 0.
pub fn positive(value: f64, name: &str) -> Result<f32> {
    let real = real(value, name)?;
    let rounded = if value > 0.0 { "float32 rounds that to 0, and " } else { "" };
    ensure!(real > 0.0, "{name} is {value:?}; {rounded}it must be above 0");
    Ok(real)
}

/// Returns `x x`.
pub fn square(x: f64) -> f64 {
    x * x
}

/// Returns a power by repeated squares. `f32::powi` is this loop on Linux, and a rounded power in f64 on Windows.
pub(crate) fn power(mut base: f32, mut exponent: u32) -> f32 {
    let mut result = 1.0;
    while exponent > 0 {
        if exponent % 2 == 1 {
            result *= base;
        }
        exponent /= 2;
        base *= base;
    }
    result
}
