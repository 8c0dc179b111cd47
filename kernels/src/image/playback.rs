//! Playback of action chunks: its header fields, and the memory that the action contract and playback keep from one
//! step to the next.

use super::contract::ARRAY_BINARISE;
use super::header as h;
use super::region::Region;
use super::view::Image;

impl Image<'_> {
    /// Returns the number of chunks that a temporal ensemble averages for an action; 0 without an ensemble.
    pub fn horizon(&self) -> usize {
        if cfg!(feature = "chunks") { self.header.horizon() } else { 0 }
    }

    /// Returns `true` if actions come from chunks, or are averages of what chunks predict.
    pub(super) fn needs_chunks(&self) -> bool {
        self.header.chunk() > 1 || self.header.horizon() > 0
    }

    /// Returns the number of actions that blend the rest of a chunk into the next one; 0 if the rest is dropped.
    pub fn overlap(&self) -> usize {
        if cfg!(feature = "chunks") { self.header.overlap() } else { 0 }
    }

    /// Returns `true` if the rest of a chunk plays while the next one is computed: with an overlap or an ensemble.
    pub fn keeps_rest(&self) -> bool {
        self.overlap() > 0 || self.horizon() > 0
    }

    /// Returns the age, in control periods since its observation, from which on an action never plays; `None` if
    /// actions play at any age.
    pub fn deadline(&self) -> Option<usize> {
        Some(self.header.deadline()).filter(|periods| *periods > 0)
    }

    /// Returns the weight in an ensemble of a chunk that comes after `count` others, and the reciprocal of the sum of
    /// their weights and its own.
    pub(crate) fn ensemble(&self, count: usize) -> [f32; 2] {
        let at = self.ensemble_at().wrapping_add(count);
        [at, at.wrapping_add(self.horizon())].map(|at| f32::from_bits(self.word(at)))
    }

    /// Returns the offset of the ensemble's weights: after the contract's arrays.
    fn ensemble_at(&self) -> usize {
        self.header.contract().wrapping_add(self.contract_count() * self.act_len())
    }

    /// Returns the arena region of the on/off states of binarized values, a word for each value of an action; empty
    /// without binarization.
    pub(crate) fn switches(&self) -> Region {
        let len = if self.has_contract(ARRAY_BINARISE) { self.act_len() } else { 0 };
        Region { offset: self.action().end(), len }
    }

    /// Returns the arena region that playback keeps ([`kept_words`]). With a horizon: for each of that many future
    /// periods, the weighted sum of its actions; then, for each, their number. With an overlap: the rest of the
    /// previous chunk.
    pub(crate) fn kept(&self) -> Region {
        let sizes = [self.act_len(), self.chunk(), self.execute()];
        let len = kept_words(sizes, self.horizon(), self.overlap());
        // A longer region does not fit an arena, nor 32 bits.
        Region { offset: self.switches().end(), len: len.min(h::MAX_SCRATCH) }
    }
}

/// Returns the words that playback keeps, from the lengths of an action, a chunk and its executed actions, the horizon
/// and the overlap.
pub const fn kept_words([act_len, chunk, execute]: [usize; 3], horizon: usize, overlap: usize) -> usize {
    match (horizon, overlap) {
        (0, 0) => 0,
        (0, _) => chunk.saturating_sub(execute) * act_len,
        (horizon, _) => horizon * (act_len + 1),
    }
}
