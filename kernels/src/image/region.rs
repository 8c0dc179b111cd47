//! Regions of the arena.

use core::ops::Range;

/// A region of the arena.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Region {
    /// First word.
    pub offset: usize,
    /// Words.
    pub len: usize,
}

impl Region {
    /// The words as an index range.
    pub fn range(self) -> Range<usize> {
        self.offset..self.end()
    }

    /// The word behind the last one.
    pub(crate) fn end(self) -> usize {
        self.offset + self.len
    }

    pub(super) fn overlaps(self, other: Self) -> bool {
        self.offset < other.end() && other.offset < self.end()
    }
}
