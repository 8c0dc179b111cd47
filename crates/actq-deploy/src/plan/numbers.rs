//! Checks of numbers.

use actq::error::{Result, bail, ensure};

use crate::description::Numbers;

/// Refuses numbers that are not finite in f32.
pub(super) fn finite(numbers: &[f64]) -> Result<()> {
    match numbers.iter().position(|number| !(*number as f32).is_finite()) {
        Some(i) => bail!("number {i} is {:e}; give numbers from -3.4e38 to 3.4e38", numbers[i]),
        None => Ok(()),
    }
}

/// Returns a number for each of `len` values.
pub(super) fn each(numbers: &Numbers, len: usize) -> Result<Vec<f64>> {
    let numbers = match numbers {
        Numbers::All(number) => vec![*number; len],
        Numbers::Each(numbers) => numbers.clone(),
    };
    finite(&numbers)?;
    ensure!(numbers.len() == len, "it has {} numbers; {len} are needed", numbers.len());
    Ok(numbers)
}
