//! The record in a slot's first bytes, which describes its image.
//!
//! Little-endian words: magic, format, length, CRC-32 of the image, version, generation, 1 if a signature follows, the
//! signature (64 bytes), zeros, the build, and the CRC-32 (ISO-HDLC) of all bytes before it. Older firmware wrote no build:
//! 0, which is another one.

use actq_link::frame::CRC;

use crate::update::Plan;

/// Bytes of a record; a multiple of each unit of writing.
pub(super) const BYTES: usize = 128;

const MAGIC: u32 = u32::from_le_bytes(*b"ACTS");
const FORMAT: u32 = 1;

/// Record of a complete image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Record {
    pub(super) plan: Plan,
    /// One more than the highest generation so far.
    pub(super) generation: u32,
    pub(super) signature: Option<[u8; 64]>,
    /// Build of the firmware that wrote it ([`super::Slots::new`]).
    pub(super) build: u32,
}

impl Record {
    pub(super) fn to_bytes(self) -> [u8; BYTES] {
        let Plan { length, crc, version } = self.plan;
        let words = [MAGIC, FORMAT, length, crc, version, self.generation, self.signature.is_some().into()];
        let words = words.iter().flat_map(|word| word.to_le_bytes());
        let content = words.chain(self.signature.unwrap_or([0; 64]));
        let mut bytes = [0; BYTES];
        bytes.iter_mut().zip(content).for_each(|(place, byte)| *place = byte);
        if let Some((content, checksum)) = bytes.split_last_chunk_mut() {
            if let Some((_, build)) = content.split_last_chunk_mut() {
                *build = self.build.to_le_bytes();
            }
            *checksum = CRC.checksum(content).to_le_bytes();
        }
        bytes
    }

    /// Decodes a record; `None` if the bytes are not one.
    pub(super) fn from_bytes(bytes: &[u8; BYTES]) -> Option<Self> {
        let (content, checksum) = bytes.split_last_chunk()?;
        if CRC.checksum(content) != u32::from_le_bytes(*checksum) {
            return None;
        }
        let (words, rest) = content.split_first_chunk::<28>()?;
        let (words, _) = words.as_chunks();
        let [magic, format, length, crc, version, generation, signed] =
            <[[u8; 4]; 7]>::try_from(words).ok()?.map(u32::from_le_bytes);
        let signature = (signed != 0).then_some(*rest.first_chunk()?);
        let build = u32::from_le_bytes(*rest.last_chunk()?);
        let plan = Plan { length, crc, version };
        ((magic, format) == (MAGIC, FORMAT)).then_some(Self { plan, generation, signature, build })
    }
}
