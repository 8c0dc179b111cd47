//! The checksum.

use super::header::{UNCHECKED_WORDS, W_BYTES, W_CRC};

/// CRC-32 (ISO-HDLC) of an image's bytes behind the fields that it does not cover.
pub const fn checksum(bytes: &[u8]) -> u32 {
    const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
    match bytes.split_at_checked(UNCHECKED_WORDS * 4) {
        Some((_, checked)) => CRC.checksum(checked),
        None => CRC.checksum(&[]),
    }
}

/// Writes length and checksum into an image that is otherwise complete; `None` where it is shorter than what it should
/// name.
pub fn seal(bytes: &mut [u8]) -> Option<()> {
    let len = u32::try_from(bytes.len()).ok()?;
    *bytes.get_mut(4 * W_BYTES..)?.first_chunk_mut()? = len.to_le_bytes();
    let crc = checksum(bytes);
    *bytes.get_mut(4 * W_CRC..)?.first_chunk_mut()? = crc.to_le_bytes();
    Some(())
}
