//! Reads the running image again and again, to notice that flash has changed.

use actq_link::frame::CRC;
use crc::Digest;

/// CRC-32 of all bytes, in pieces.
pub struct Scrub {
    expected: u32,
    digest: Digest<'static, u32>,
    at: usize,
}

impl Scrub {
    /// Scrubs an image that is right now: reads it once.
    pub fn new(image: &[u8]) -> Self {
        Self { expected: CRC.checksum(image), digest: CRC.digest(), at: 0 }
    }

    /// Reads up to `bytes` on; at the image's end, whether it is still what it was. Then it begins anew.
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
