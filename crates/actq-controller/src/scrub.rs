//! Scrub: reads the running image repeatedly to detect changed flash.

use actq_link::frame::CRC;
use crc::Digest;

/// Returns what a scrub expects of an image. Take it before the image's check: a change between both is then found by
/// the check, or by the scrub.
pub fn checksum(image: &[u8]) -> u32 {
    CRC.checksum(image)
}

/// CRC-32 of an image, computed in pieces.
pub struct Scrub {
    expected: u32,
    digest: Digest<'static, u32>,
    at: usize,
}

impl Scrub {
    /// Creates a scrub of an image with this [`checksum`].
    pub const fn new(expected: u32) -> Self {
        Self { expected, digest: CRC.digest(), at: 0 }
    }

    /// Reads up to `bytes` more bytes. At the image's end, returns `true` if the image is unchanged, and starts over.
    pub fn advance(&mut self, image: &[u8], bytes: usize) -> Option<bool> {
        let end = self.at.saturating_add(bytes).min(image.len());
        self.digest.update(image.get(self.at..end).unwrap_or_default());
        self.at = end;
        if end < image.len() {
            return None;
        }
        self.at = 0;
        Some(core::mem::replace(&mut self.digest, CRC.digest()).finalize() == self.expected)
    }
}
