//! Regions of the arena.

use core::ops::Range;

/// A region of the arena.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Region {
    /// Index of the first word.
    pub offset: usize,
    /// Number of words.
    pub len: usize,
}

impl Region {
    /// Returns the words as an index range.
    pub fn range(self) -> Range<usize> {
        self.offset..self.end()
    }

    /// Returns the index after the last word. In an image whose content was not checked it may wrap; such a region
    /// has no words.
    pub(crate) fn end(self) -> usize {
        self.offset.wrapping_add(self.len)
    }

    /// Returns `true` if both regions share a word.
    pub(super) fn overlaps(self, other: Self) -> bool {
        self.offset < other.end() && other.offset < self.end()
    }
}
