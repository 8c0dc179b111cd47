//! Reader and writer of little-endian fields.

use cobs::CobsEncoder;
use crc::{Digest, Table};

use crate::frame::CRC;

/// Reads fields from a payload.
#[derive(Clone, Copy)]
pub(crate) struct Reader<'a>(pub(crate) &'a [u8]);

impl<'a> Reader<'a> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (field, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*field)
    }

    pub(crate) fn u8(&mut self) -> Option<u8> {
        self.take().map(u8::from_le_bytes)
    }

    pub(crate) fn u16(&mut self) -> Option<u16> {
        self.take().map(u16::from_le_bytes)
    }

    pub(crate) fn u32(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }

    pub(crate) fn f32(&mut self) -> Option<f32> {
        self.take().map(f32::from_le_bytes)
    }

    /// Returns the next `N` bytes, in place.
    pub(crate) fn array<const N: usize>(&mut self) -> Option<&'a [u8; N]> {
        let (array, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(array)
    }

    /// Returns the remaining bytes.
    pub(crate) fn rest(&mut self) -> &'a [u8] {
        core::mem::take(&mut self.0)
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

/// Stuffs fields into a buffer one by one and computes their checksum. [`Writer::finish`] reports a buffer that was too
/// small.
pub(crate) struct Writer<'b> {
    cobs: CobsEncoder<'b>,
    crc: Digest<'static, u32, Table<1>>,
    fits: bool,
}

impl<'b> Writer<'b> {
    pub(crate) fn new(buffer: &'b mut [u8]) -> Self {
        Self { cobs: CobsEncoder::new(buffer), crc: CRC.digest(), fits: true }
    }

    pub(crate) fn bytes(&mut self, bytes: &[u8]) {
        self.crc.update(bytes);
        self.push(bytes);
    }

    fn push(&mut self, bytes: &[u8]) {
        // `push` holds back the last byte of its argument, so it cannot take an empty one.
        self.fits &= bytes.is_empty() || self.cobs.push(bytes).is_ok();
    }

    pub(crate) fn u8(&mut self, value: u8) {
        self.bytes(&[value]);
    }

    pub(crate) fn u16(&mut self, value: u16) {
        self.bytes(&value.to_le_bytes());
    }

    pub(crate) fn u32(&mut self, value: u32) {
        self.bytes(&value.to_le_bytes());
    }

    pub(crate) fn f32(&mut self, value: f32) {
        self.bytes(&value.to_le_bytes());
    }

    /// Appends the checksum and returns the number of bytes in the buffer, without the zero that ends a frame. `None`
    /// if the buffer is too small.
    pub(crate) fn finish(mut self) -> Option<usize> {
        let crc = self.crc.clone().finalize();
        self.push(&crc.to_le_bytes());
        self.fits.then(|| self.cobs.finalize())
    }
}
