//! Scrub: reads the running image repeatedly to detect changed flash.

use actq_link::frame::CRC;
use crc::Digest;

/// CRC-32 of an image, computed in pieces.
pub struct Scrub {
    expected: u32,
    digest: Digest<'static, u32>,
    at: usize,
}

impl Scrub {
    /// Creates a scrub of an image that is valid now, and reads it once.
    pub fn new(image: &[u8]) -> Self {
        Self { expected: CRC.checksum(image), digest: CRC.digest(), at: 0 }
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
