//! Values with units: numbers, or text as the options of `actq quantize` take it.

use std::fmt;

use actq::error::Result;
use actq::units;
use actq_kernels::Width;
use serde::de::{Deserialize, Deserializer, Error};

/// A number, or text with a unit.
#[derive(serde::Deserialize)]
#[serde(untagged)]
enum Quantity {
    Whole(u64),
    Number(f64),
    Text(String),
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Whole(number) => number.fmt(f),
            Self::Number(number) => number.fmt(f),
            Self::Text(text) => text.fmt(f),
        }
    }
}

impl Quantity {
    fn read<T, E: Error>(&self, key: &str, read: impl FnOnce(&str) -> Result<T>) -> Result<T, E> {
        let text = self.to_string();
        read(&text).map_err(|error| E::custom(format!("{key}: {text}: {error}")))
    }
}

/// Reads sizes in bytes, each as 98304 or "96K".
pub(super) fn sizes<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<usize>, D::Error> {
    let given: Vec<Quantity> = Vec::deserialize(deserializer)?;
    given.iter().map(|quantity| quantity.read("flash", units::bytes)).collect()
}

/// Reads a clock in Hz, as 168000000 or "168M".
pub(super) fn clock<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Quantity::deserialize(deserializer)?.read("clock", units::hertz)
}

/// Reads widths of codes in bits.
pub(super) fn widths<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<Width>, D::Error> {
    let given: Vec<u32> = Vec::deserialize(deserializer)?;
    let width =
        |bits: &u32| Width::from_bits(*bits).ok_or_else(|| D::Error::custom(format!("bits: {bits}: use 2, 3, 4 or 8")));
    given.iter().map(width).collect()
}
