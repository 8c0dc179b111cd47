//! Numbers of a text as f32.

use crate::error::{Result, ensure};

/// A number as f32, rounded; refuses what f32 cannot hold.
pub fn real(value: f64, name: &str) -> Result<f32> {
    let real = value as f32;
    ensure!(real.is_finite(), "{name} is {value:?}, beyond float32's range");
    Ok(real)
}

/// As [`real`], above 0.
pub fn positive(value: f64, name: &str) -> Result<f32> {
    let real = real(value, name)?;
    let rounded = if value > 0.0 { "float32 rounds that to 0, and " } else { "" };
    ensure!(real > 0.0, "{name} is {value:?}; {rounded}it must be above 0");
    Ok(real)
}
