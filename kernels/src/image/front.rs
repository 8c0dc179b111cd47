//! The sections of an image during its check, in their order.

#[cfg(feature = "attention")]
use super::attention::Cache;
use super::words::section;
use crate::error::ImageError;

/// Takes sections in their order in the image. No two share a word. Constants that several operations have in common
/// are in the image once, and are checked once: so the check is linear in the image's length.
pub(super) struct Front<'a> {
    pub(super) words: &'a [u32],
    /// End of the last section.
    pub(super) at: usize,
    /// From here to that end all words are finite constants.
    pub(super) finite: usize,
    /// End of the caches of the prefix that operations have read.
    #[cfg(feature = "attention")]
    pub(super) prefix: usize,
    /// The next of these caches, if an operation has written the network's own tokens to it.
    #[cfg(feature = "attention")]
    pub(super) kept: Option<Cache>,
}

impl<'a> Front<'a> {
    #[inline(always)]
    pub(super) fn take(&mut self, offset: usize, len: usize) -> Result<&'a [u32], ImageError> {
        self.next(offset, len).ok_or(ImageError::Section)
    }

    #[inline(never)]
    fn next(&mut self, offset: usize, len: usize) -> Option<&'a [u32]> {
        let section = section(self.words, offset, len).filter(|_| offset >= self.at)?;
        self.at = offset + len;
        self.finite = self.at;
        Some(section)
    }

    /// Takes f32 constants as [`Self::take`] does, or again some that were taken before and are finite.
    #[inline(never)]
    pub(super) fn constants(&mut self, offset: usize, len: usize) -> Result<&'a [u32], ImageError> {
        if self.has(offset, len) {
            return section(self.words, offset, len).ok_or(ImageError::Section);
        }
        let begin = if offset == self.at { self.finite } else { offset };
        let constants = self.take(offset, len)?;
        if constants.iter().all(|&w| f32::from_bits(u32::from_le(w)).is_finite()) {
            self.finite = begin;
        }
        Ok(constants)
    }

    /// Takes constants; refuses them if one is not finite.
    #[inline(never)]
    pub(super) fn take_finite(&mut self, offset: usize, len: usize) -> Result<(), ImageError> {
        if !self.has(offset, len) {
            self.constants(offset, len)?;
        }
        if self.has(offset, len) { Ok(()) } else { Err(ImageError::Constant) }
    }

    /// Returns `true` if these were taken before and are finite.
    fn has(&self, offset: usize, len: usize) -> bool {
        self.finite <= offset && offset <= self.at && len <= self.at - offset
    }
}
