//! How chunks are played: what the header says of it, and the memory that the action contract and playback keep from
//! one step to the next.

use super::contract::ARRAY_BINARISE;
use super::header as h;
use super::region::Region;
use super::view::Image;
use super::words::{high, low};

impl Image<'_> {
    /// Chunks that are averaged for an action (temporal ensembling); 0 where an action is of one chunk.
    pub fn horizon(&self) -> usize {
        high(self.head(h::W_MATRIX_COUNT))
    }

    /// How many actions lead over from what is left of the chunk before to a new one; 0 where that is dropped.
    pub fn overlap(&self) -> usize {
        low(self.head(h::W_PLAYBACK))
    }

    /// The age, in control periods since its observation, from which on an action never plays; `None` where a chunk's
    /// plays at any age.
    pub fn deadline(&self) -> Option<usize> {
        Some(high(self.head(h::W_PLAYBACK))).filter(|periods| *periods > 0)
    }

    /// Of the chunk before which an ensemble has `count` others of an action, its weight, and the reciprocal of the sum
    /// of the weights with its own.
    pub(crate) fn ensemble(&self, count: usize) -> [f32; 2] {
        let at = self.ensemble_at().wrapping_add(count);
        [at, at.wrapping_add(self.horizon())].map(|at| f32::from_bits(self.word(at)))
    }

    /// The ensemble's weights stand behind the contract's arrays.
    fn ensemble_at(&self) -> usize {
        (self.head(h::W_CONTRACT) as usize).wrapping_add(self.contract_count() * self.act_len())
    }

    /// Arena region of what is on and what is off of a binarised action, a word for each of its values: empty where
    /// none is.
    pub(crate) fn switches(&self) -> Region {
        let len = if self.has_contract(ARRAY_BINARISE) { self.act_len() } else { 0 };
        Region { offset: self.action().end(), len }
    }

    /// Arena region of what playback keeps ([`kept_words`]): with a horizon, for each of so many periods from now on
    /// the sum of the weighted actions for it, then for each their number; with an overlap, what was left of the chunk
    /// before.
    pub(crate) fn kept(&self) -> Region {
        let sizes = [self.act_len(), self.chunk(), self.execute()];
        let len = kept_words(sizes, self.horizon(), self.overlap());
        // More has no place in an arena, and does not fit 32 bits.
        Region { offset: self.switches().end(), len: len.min(h::MAX_SCRATCH) }
    }
}

/// Words that playback keeps, from the lengths of an action, of a chunk and of what is executed of it, the horizon and
/// the overlap.
pub const fn kept_words([act_len, chunk, execute]: [usize; 3], horizon: usize, overlap: usize) -> usize {
    match (horizon, overlap) {
        (0, 0) => 0,
        (0, _) => chunk.saturating_sub(execute) * act_len,
        (horizon, _) => horizon * (act_len + 1),
    }
}
