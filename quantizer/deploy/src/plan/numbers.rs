//! Checks of numbers.

use actq::error::{Result, bail, ensure};

use crate::description::Numbers;

/// Refuses numbers that are not finite.
pub(super) fn finite(numbers: &[f64]) -> Result<()> {
    match numbers.iter().position(|number| !number.is_finite()) {
        Some(i) => bail!("number {i} is {}; give finite numbers", numbers[i]),
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
