//! Words of an image and their halves.

#[cfg(feature = "writer")]
use core::fmt;

use crate::error::ImageError;

/// Words of the header.
pub(super) const HEADER_WORDS: usize = 32;

/// Word `i`; 0 behind the end.
pub(super) fn word(words: &[u32], i: usize) -> u32 {
    u32::from_le(words.get(i).copied().unwrap_or(0))
}

/// The u16 in the low half.
pub(super) const fn low(word: u32) -> usize {
    (word & 0xffff) as usize
}

/// The u16 in the high half.
pub(super) const fn high(word: u32) -> usize {
    (word >> 16) as usize
}

/// A size that no field of a record holds.
#[cfg(feature = "writer")]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TooLarge(pub usize);

#[cfg(feature = "writer")]
impl fmt::Display for TooLarge {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a size of the policy ({}) exceeds the format's limit of 65535", self.0)
    }
}

#[cfg(feature = "writer")]
impl core::error::Error for TooLarge {}

/// Two u16 in a word.
#[cfg(feature = "writer")]
pub(super) fn halves(low: usize, high: usize) -> Result<u32, TooLarge> {
    let most = if low > high { low } else { high };
    if most > 0xffff { Err(TooLarge(most)) } else { Ok(low as u32 | (high as u32) << 16) }
}

/// `len` words at `offset`, refused where they are not all in the image and behind its header.
#[inline(never)]
pub(super) fn section(image: &[u32], offset: usize, len: usize) -> Option<&[u32]> {
    behind(image, offset).get(..len)
}

/// The record at `offset`.
pub(super) fn record<const N: usize>(image: &[u32], offset: usize) -> Result<&[u32; N], ImageError> {
    behind(image, offset).first_chunk().ok_or(ImageError::Section)
}

/// What stands in the image from `offset` on, behind its header.
pub(super) fn behind(image: &[u32], offset: usize) -> &[u32] {
    if offset < HEADER_WORDS { &[] } else { image.get(offset..).unwrap_or_default() }
}

/// Records, or what is counted like them: where they stand in the image, and how many they are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Records {
    /// Word of the first.
    pub offset: u32,
    /// How many.
    pub count: usize,
}
