//! An image whose words tests change: those of this crate, and by path those of `host-tests`.
#![allow(dead_code, reason = "each of them uses some of it")]

use actq_kernels::image::{checksum, header as h};
use actq_kernels::{Image, ImageError};

/// The words of an image, little-endian.
#[derive(Clone)]
pub(crate) struct Draft(pub(crate) Vec<u32>);

impl Draft {
    pub(crate) fn of(image: &[u8]) -> Self {
        Self(image.as_chunks().0.iter().map(|word| u32::from_ne_bytes(*word)).collect())
    }

    pub(crate) fn bytes(&self) -> &[u8] {
        bytemuck::cast_slice(&self.0)
    }

    pub(crate) fn check(&self) -> Result<Image<'_>, ImageError> {
        Image::new_checked(self.bytes())
    }

    pub(crate) fn get(&self, at: usize) -> u32 {
        u32::from_le(self.0[at])
    }

    pub(crate) fn offset(&self, at: usize) -> usize {
        self.get(at) as usize
    }

    pub(crate) fn low(&self, at: usize) -> u32 {
        self.get(at) & 0xffff
    }

    pub(crate) fn high(&self, at: usize) -> u32 {
        self.get(at) >> 16
    }

    pub(crate) fn set(&mut self, at: usize, value: u32) {
        self.0[at] = value.to_le();
    }

    pub(crate) fn set_f32(&mut self, at: usize, value: f32) {
        self.set(at, value.to_bits());
    }

    pub(crate) fn set_low(&mut self, at: usize, value: u32) {
        self.set(at, (self.get(at) & 0xffff_0000) | value);
    }

    pub(crate) fn set_high(&mut self, at: usize, value: u32) {
        self.set(at, self.low(at) | value << 16);
    }

    pub(crate) fn map_low(&mut self, at: usize, change: impl Fn(u32) -> u32) {
        self.set_low(at, change(self.low(at)));
    }

    pub(crate) fn map_high(&mut self, at: usize, change: impl Fn(u32) -> u32) {
        self.set_high(at, change(self.high(at)));
    }

    /// Updates the checksum.
    pub(crate) fn seal(&mut self) {
        self.set(h::W_CRC, checksum(self.bytes()));
    }

    /// Returns the position of the record of the `nth` operation with this code.
    pub(crate) fn op(&self, (code, nth): (u8, usize)) -> usize {
        let records = (0..self.high(h::W_KIND) as usize).map(|i| self.offset(h::W_OPS) + i * h::OP_WORDS);
        records.filter(|&at| self.get(at) as u8 == code).nth(nth).expect("the image has the operation")
    }

    /// Returns the position of the constants or the matrix record of an operation.
    pub(crate) fn data(&self, which: (u8, usize)) -> usize {
        self.offset(self.op(which) + 3)
    }

    /// Returns the position of block record `i` of a linear operation.
    pub(crate) fn block(&self, which: (u8, usize), i: usize) -> usize {
        self.offset(self.data(which) + 3) + i * h::BLOCK_WORDS
    }
}
