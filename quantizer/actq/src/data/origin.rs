//! The image that controlled the robot while a recording was made.

use std::path::Path;

use super::arrays::one;
use crate::error::{Context as _, Result};
use crate::import::values::Values;

/// Name of the array that holds the image's CRC-32: one integer.
pub const CRC32: &str = "crc32";

/// Reads the CRC-32 of the image whose rollout a recording is; `None` if it names none.
pub fn driven_by(path: &Path) -> Result<Option<u32>> {
    let array = one(path, CRC32).with_context(|| path.display().to_string())?;
    let number = array.and_then(|array| match array.values {
        Values::I64(values) if values.len() == 1 => Some(values[0]),
        _ => None,
    });
    Ok(number.and_then(|number| u32::try_from(number).ok()))
}
