//! The origin of a recording: the image that controlled the robot, or the description by which it was made.

use std::path::Path;

use super::arrays::one;
use crate::error::{Context as _, Result};
use crate::import::values::Values;

/// Name of the array that holds the image's CRC-32: one integer.
pub const CRC32: &str = "crc32";

/// Name of an array that only the log of `actq link stream` has.
pub(super) const APPLIED: &str = "applied";

/// Name of the array that holds the checksum of the description by which a recording was made: one integer.
pub const DESCRIBED: &str = "description";

/// Reads the checksum of the description by which a recording was made of raw values; `None` if it names none.
///
/// # Errors
///
/// If the file cannot be read, or its array is not one checksum.
pub fn described_by(path: &Path) -> Result<Option<u32>> {
    checksum(path, DESCRIBED, "a checksum")
}

/// Reads the CRC-32 of the image whose rollout a recording is; `None` if it names none.
///
/// # Errors
///
/// If the file cannot be read, or its array is not one CRC-32.
pub fn driven_by(path: &Path) -> Result<Option<u32>> {
    checksum(path, CRC32, "the CRC-32 of an image; record the image with actq serve --record")
}

/// Reads an array of one checksum; an error says `what` it is.
fn checksum(path: &Path, name: &str, what: &str) -> Result<Option<u32>> {
    let read = || -> Result<Option<u32>> {
        let Some(array) = one(path, name)? else { return Ok(None) };
        let number = match &array.values {
            Values::I64(values) if values.len() == 1 => u32::try_from(values[0]).ok(),
            _ => None,
        };
        number.with_context(|| format!("array {name:?} is not one int64, {what}")).map(Some)
    };
    read().with_context(|| path.display().to_string())
}

/// Returns `true` for a log of `actq link stream`: its observations are those of a recording, not the image's own path.
pub(crate) fn is_link_log(path: &Path) -> Result<bool> {
    Ok(one(path, APPLIED).with_context(|| path.display().to_string())?.is_some())
}
