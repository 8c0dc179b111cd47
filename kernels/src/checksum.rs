//! Checksums of scratch memory that nothing may change for a while: a flipped bit ends the step instead of changing an
//! action. Without the feature `checksums` they hold nothing and always agree.

/// Computes the checksum of words in any order: their exclusive or, which every single bit changes.
#[cfg(feature = "checksums")]
pub(crate) use crate::arch::xor;
use crate::error::Fault;
use crate::meter::{Meter, Work};

/// Weights of a product for each word of a checksum: before and after together, a word takes two and a half instructions,
/// so all words at most 3 % of those of a product at 2 bits.
pub(crate) const WEIGHTS: usize = 112;

/// A checksum of memory, while there is one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Checksum(#[cfg(feature = "checksums")] Option<u32>);

impl Checksum {
    /// Returns a number of values: comparing them by magnitude takes longer than a checksum of this number of words.
    pub(crate) const fn values(words: usize) -> usize {
        words / 2
    }

    /// Returns the work of a checksum of words.
    pub(crate) const fn work(words: usize) -> Work<'static> {
        Work::Magnitude(Self::values(words))
    }
}

#[cfg(feature = "checksums")]
impl Checksum {
    /// Takes that of memory.
    pub(crate) fn of(sum: impl FnOnce() -> u32) -> Self {
        Self(Some(sum()))
    }

    /// Returns `true` if there is one.
    pub(crate) fn is_set(self) -> bool {
        self.0.is_some()
    }

    /// Adds more memory.
    pub(crate) fn add(&mut self, sum: impl FnOnce() -> u32) {
        self.0 = Some(self.0.unwrap_or(0) ^ sum());
    }

    /// Requires that the memory, whose checksum is `sum` now, has not changed.
    ///
    /// # Errors
    ///
    /// [`Fault::Damaged`].
    pub(crate) fn check(self, sum: impl FnOnce() -> u32) -> Result<(), Fault> {
        if self.0.is_none_or(|before| before == sum()) { Ok(()) } else { Err(Fault::Damaged) }
    }

    /// Does the same as [`Self::check`] for `words`; returns `false` if the budget has no room for it.
    #[inline(never)]
    pub(crate) fn holds(self, words: &[u32], budget: &mut impl Meter) -> Result<bool, Fault> {
        if self.is_set() {
            if budget.take(1, Self::work(words.len())) == 0 {
                return Ok(false);
            }
            self.check(|| xor(words))?;
        }
        Ok(true)
    }
}

#[cfg(not(feature = "checksums"))]
impl Checksum {
    pub(crate) fn of(_: impl FnOnce() -> u32) -> Self {
        Self()
    }

    pub(crate) fn is_set(self) -> bool {
        false
    }

    pub(crate) fn add(&mut self, _: impl FnOnce() -> u32) {}

    pub(crate) fn check(self, _: impl FnOnce() -> u32) -> Result<(), Fault> {
        Ok(())
    }

    #[inline(always)]
    pub(crate) fn holds(self, _: &[u32], _: &mut impl Meter) -> Result<bool, Fault> {
        Ok(true)
    }
}

/// Never called.
#[cfg(not(feature = "checksums"))]
pub(crate) const fn xor(_: &[u32]) -> u32 {
    0
}
