//! Words of an image and their halves.

use core::fmt;

use crate::error::ImageError;

/// Words of the header.
pub(super) const HEADER_WORDS: usize = 32;

/// Returns word `i`; 0 after the end.
pub(super) fn word(words: &[u32], i: usize) -> u32 {
    u32::from_le(words.get(i).copied().unwrap_or(0))
}

/// Returns the u16 in the low half.
pub(super) const fn low(word: u32) -> usize {
    (word & 0xffff) as usize
}

/// Returns the u16 in the high half.
pub(super) const fn high(word: u32) -> usize {
    (word >> 16) as usize
}

/// The part of a word that holds a field.
#[derive(Clone, Copy, Debug)]
pub(super) enum Part {
    /// The low half.
    Low,
    /// The high half.
    High,
    /// All of it.
    Whole,
}

impl Part {
    /// Returns the field in a word.
    #[inline(always)]
    pub(super) const fn of(self, word: u32) -> usize {
        match self {
            Self::Low => low(word),
            Self::High => high(word),
            Self::Whole => word as usize,
        }
    }

    /// Returns a word with this field; its other bits are 0.
    pub(super) fn put(self, value: usize) -> Result<u32, TooLarge> {
        match self {
            Self::Low => halves(value, 0),
            Self::High => halves(0, value),
            Self::Whole => u32::try_from(value).map_err(|_| TooLarge(value)),
        }
    }
}

/// A size that does not fit its field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TooLarge(pub usize);

impl fmt::Display for TooLarge {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a size of the policy is {}; the format's limit is 65535", self.0)
    }
}

impl core::error::Error for TooLarge {}

/// Packs two u16 in a word.
pub(super) fn halves(low: usize, high: usize) -> Result<u32, TooLarge> {
    let most = if low > high { low } else { high };
    if most > 0xffff { Err(TooLarge(most)) } else { Ok(low as u32 | (high as u32) << 16) }
}

/// Returns `len` words at `offset`; `None` unless all of them are in the image and after its header.
#[inline(never)]
pub(super) fn section(image: &[u32], offset: usize, len: usize) -> Option<&[u32]> {
    rest_from(image, offset).get(..len)
}

/// Returns the record at `offset`.
pub(super) fn record<const N: usize>(image: &[u32], offset: usize) -> Result<&[u32; N], ImageError> {
    rest_from(image, offset).first_chunk().ok_or(ImageError::Section)
}

/// Returns the image's words from `offset` on; empty inside the header.
pub(super) fn rest_from(image: &[u32], offset: usize) -> &[u32] {
    if offset < HEADER_WORDS { &[] } else { image.get(offset..).unwrap_or_default() }
}

/// Place and number of records in the image, or of other items.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Records {
    /// Offset of the first, in words.
    pub offset: u32,
    /// Number of records.
    pub count: usize,
}
