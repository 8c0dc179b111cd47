//! The checksum.

use super::header::UNCHECKED_WORDS;
use super::header::{W_BYTES, W_CRC};
use crate::error::ImageError;

/// Remainders of four bits: a sixteenth of the usual table of 1 KB. They read an image word by word.
static REMAINDERS: [u32; 16] = {
    // The polynomial of CRC-32, its lowest power in the highest bit.
    const POLYNOMIAL: u32 = 0xedb8_8320;
    let mut remainders = [0; 16];
    let mut i = 0;
    while i < remainders.len() {
        let (mut remainder, mut bit) = (i as u32, 0);
        while bit < 4 {
            remainder = remainder >> 1 ^ if remainder & 1 == 1 { POLYNOMIAL } else { 0 };
            bit += 1;
        }
        remainders[i] = remainder;
        i += 1;
    }
    remainders
};

/// Computes the CRC-32 (ISO-HDLC, as in zlib) of an image's bytes, after the fields that it does not cover.
pub const fn checksum(bytes: &[u8]) -> u32 {
    let checked = match bytes.split_at_checked(UNCHECKED_WORDS * 4) {
        Some((_, checked)) => checked,
        None => &[],
    };
    let (words, rest) = checked.as_chunks();
    let mut crc = !0;
    let mut i = 0;
    while i < words.len() {
        crc = reduce(crc ^ u32::from_le_bytes(words[i]), 4);
        i += 1;
    }
    let mut i = 0;
    while i < rest.len() {
        crc = reduce(crc ^ rest[i] as u32, 1);
        i += 1;
    }
    !crc
}

/// Divides the low `bytes` bytes out of `crc`.
#[inline(always)]
const fn reduce(mut crc: u32, bytes: usize) -> u32 {
    let mut i = 0;
    while i < bytes {
        crc = REMAINDERS[crc as usize & 15] ^ crc >> 4;
        crc = REMAINDERS[crc as usize & 15] ^ crc >> 4;
        i += 1;
    }
    crc
}

/// Writes length and checksum into an image that is otherwise complete.
///
/// # Errors
///
/// [`ImageError::TooShort`] if `bytes` ends before these fields, [`ImageError::Length`] if its length needs more than
/// 32 bits.
pub fn seal(bytes: &mut [u8]) -> Result<(), ImageError> {
    let len = u32::try_from(bytes.len()).map_err(|_| ImageError::Length)?;
    write(bytes, W_BYTES, len)?;
    let crc = checksum(bytes);
    write(bytes, W_CRC, crc)
}

/// Writes word `at` of an image.
fn write(bytes: &mut [u8], at: usize, word: u32) -> Result<(), ImageError> {
    let field = bytes.get_mut(4 * at..).and_then(|rest| rest.first_chunk_mut()).ok_or(ImageError::TooShort)?;
    *field = word.to_le_bytes();
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The check value of this CRC in the catalogue of parametrised CRC algorithms, and two of zlib's `crc32`.
    #[test]
    fn checksums_are_those_of_crc_32() {
        let mut bytes = [0; 4 * UNCHECKED_WORDS].to_vec();
        assert_eq!(checksum(&bytes), 0);
        assert_eq!(checksum(&bytes[1..]), 0);
        bytes.extend(b"123456789");
        assert_eq!(checksum(&bytes), 0xcbf4_3926);
        bytes.truncate(4 * UNCHECKED_WORDS + 8);
        assert_eq!(checksum(&bytes), 0x9ae0_daaf);
    }
}
