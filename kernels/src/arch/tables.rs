//! Memory for the tables of bit planes, and for activations with start values.

#[cfg(feature = "scalar")]
use crate::layout::{STRIP, Width};
#[cfg(feature = "scalar")]
use crate::meter::RUN;

/// Words of a table: 256 halfwords.
#[cfg(feature = "scalar")]
pub(crate) const TABLE_WORDS: usize = 128;

/// A table of sums.
#[cfg(feature = "scalar")]
pub(super) type Table = [u16; 2 * TABLE_WORDS];

/// Most tables that are of use at a time: more of them save less than they take.
#[cfg(feature = "scalar")]
const MAX_TABLES: usize = 8;

/// Words of two columns' activations with their start values.
#[cfg(feature = "scalar")]
pub(crate) const TWO_COLUMNS: usize = 4;

/// Pairs of columns for which there is always memory, a multiple of the step's.
#[cfg(feature = "scalar")]
pub(crate) const LEAST_PAIRS: usize = 16;

/// Most pairs of columns that are of use at a time.
#[cfg(feature = "scalar")]
const MAX_PAIRS: usize = 64;

/// Memory for tables. A build without the scalar layouts has none, and passes nothing.
#[derive(Debug, Default)]
pub struct Tables<'w> {
    #[cfg(feature = "scalar")]
    words: &'w mut [u32],
    #[cfg(not(feature = "scalar"))]
    words: core::marker::PhantomData<&'w mut [u32]>,
}

#[cfg(feature = "scalar")]
impl<'w> Tables<'w> {
    /// Splits a work area after the `prepared` words of a vector.
    #[inline(always)]
    pub fn split(work: &'w mut [u32], prepared: usize) -> (&'w [u32], Self) {
        let (prepared, words) = work.split_at_mut(prepared.min(work.len()));
        (prepared, Self { words })
    }

    /// Lends the memory.
    #[inline(always)]
    pub(crate) fn lend(&mut self) -> Tables<'_> {
        Tables { words: self.words }
    }

    /// Takes up to half of the memory for the sums of `rows` rows; `None` for fewer than two runs of rows. Tables are then built
    /// less often.
    pub(crate) fn with_sums(self, rows: usize) -> Option<(&'w mut [i32], Self)> {
        let len = Self::sums(self.words.len(), rows)?;
        let (sums, words) = self.words.split_at_mut_checked(len)?;
        Some((bytemuck::must_cast_slice_mut(sums), Self { words }))
    }

    /// Returns the number of sums in `words` words for `rows` rows, as [`Self::with_sums`] takes them.
    #[inline(always)]
    pub(crate) fn sums(words: usize, rows: usize) -> Option<usize> {
        let len = rows.next_multiple_of(STRIP).min((words / 2) & !(STRIP - 1));
        (len > RUN).then_some(len)
    }

    /// Returns the memory.
    #[inline(always)]
    pub(super) fn words(self) -> &'w mut [u32] {
        self.words
    }

    /// Returns the words that are of use for rows of this width and of `units` units.
    pub(crate) const fn room(width: Width, units: usize) -> usize {
        let (words, most) = match width {
            Width::W2 | Width::W3 => (TABLE_WORDS, MAX_TABLES),
            Width::W4 => (0, 0),
            Width::W8 => (TWO_COLUMNS, MAX_PAIRS),
        };
        words * if units < most { units } else { most }
    }
}

#[cfg(not(feature = "scalar"))]
impl<'w> Tables<'w> {
    /// Splits a work area after the words of a vector.
    #[inline(always)]
    pub fn split(work: &'w mut [u32], _: usize) -> (&'w [u32], Self) {
        (work, Self::default())
    }

    /// Lends the memory.
    #[inline(always)]
    pub(crate) fn lend(&mut self) -> Tables<'_> {
        Tables::default()
    }
}
