//! The checksum.

use super::header::UNCHECKED_WORDS;
#[cfg(feature = "writer")]
use super::header::{W_BYTES, W_CRC};
#[cfg(feature = "writer")]
use crate::error::ImageError;

/// Computes the CRC-32 (ISO-HDLC) of an image's bytes, after the fields that it does not cover.
pub const fn checksum(bytes: &[u8]) -> u32 {
    const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
    match bytes.split_at_checked(UNCHECKED_WORDS * 4) {
        Some((_, checked)) => CRC.checksum(checked),
        None => CRC.checksum(&[]),
    }
}

/// Writes length and checksum into an image that is otherwise complete.
///
/// # Errors
///
/// [`ImageError::TooShort`] if `bytes` ends before these fields, [`ImageError::Length`] if its length needs more than
/// 32 bits.
#[cfg(feature = "writer")]
pub fn seal(bytes: &mut [u8]) -> Result<(), ImageError> {
    let len = u32::try_from(bytes.len()).map_err(|_| ImageError::Length)?;
    write(bytes, W_BYTES, len)?;
    let crc = checksum(bytes);
    write(bytes, W_CRC, crc)
}

/// Writes word `at` of an image.
#[cfg(feature = "writer")]
fn write(bytes: &mut [u8], at: usize, word: u32) -> Result<(), ImageError> {
    let field = bytes.get_mut(4 * at..).and_then(|rest| rest.first_chunk_mut()).ok_or(ImageError::TooShort)?;
    *field = word.to_le_bytes();
    Ok(())
}
