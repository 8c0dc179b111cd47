//! The state of a head as bytes, for a warm restart: everything besides the image and the observations that the next
//! actions depend on, a prefix among it.
//!
//! Words, little-endian: `ACTS`, version, checksum of the image, checksum of the words after it; seed, draws, flags
//! (bit 0: an action has played, bit 1: the output holds a chunk), the positions of playback; then regions of the
//! arena: the recurrent state with the prefix after it, the output, and everything from the last action to the work area.

use super::playback::Playback;
use super::{Head, Phase};
use crate::error::SavedError;
use crate::image::{Image, Region, checksum};

const MAGIC: u32 = u32::from_le_bytes(*b"ACTS");
/// Version of the saved state.
const VERSION: u32 = 1;
/// Words before the arena's.
const WORDS: usize = 10;
/// Index of the checksum.
const W_CHECKSUM: usize = 3;

impl Head<'_, '_> {
    /// Returns the bytes of a saved state: 40, plus the recurrent state, the output, and the words from the action to
    /// the work area.
    pub fn saved_len(&self) -> usize {
        let words = |sum: usize, region: &Region| sum.saturating_add(region.len);
        self.saved_regions().iter().fold(WORDS, words).saturating_mul(4)
    }

    /// Writes the state into `to`, of [`Self::saved_len`] bytes: recurrent state, chunks, last action, states of
    /// binarized values, seed and draws of the noise, and a prefix, however old it then is. A head that restores it
    /// continues with the same bits.
    ///
    /// # Errors
    ///
    /// [`SavedError::Begun`] between [`Self::begin`] and the action; [`SavedError::Length`] for another length.
    pub fn save(&self, to: &mut [u8]) -> Result<(), SavedError> {
        self.check_saved(to.len())?;
        let Playback { ready, next, old, slot } = self.playback;
        let flags = u32::from(self.started) | u32::from(ready) << 1;
        let [next, old, slot] = [next, old, slot].map(|n| u32::try_from(n).unwrap_or(u32::MAX));
        let head: [u32; WORDS] = [MAGIC, VERSION, self.image.crc(), 0, self.seed, self.draws, flags, next, old, slot];
        let arena = self.saved_regions().into_iter().flat_map(|r| self.arena.get(r.range()).unwrap_or_default());
        for (bytes, word) in to.as_chunks_mut().0.iter_mut().zip(head.iter().chain(arena)) {
            *bytes = word.to_le_bytes();
        }
        let sum = checksum(to).to_le_bytes();
        to.as_chunks_mut().0.iter_mut().skip(W_CHECKSUM).take(1).for_each(|bytes| *bytes = sum);
        Ok(())
    }

    /// Restores the state in `from`, which a head of the same image [saved](Self::save).
    ///
    /// # Errors
    ///
    /// Those of [`Self::save`]; [`SavedError::Version`], [`SavedError::Image`] and [`SavedError::Damaged`] for the
    /// bytes. On an error the head keeps its state.
    pub fn restore(&mut self, from: &[u8]) -> Result<(), SavedError> {
        self.check_saved(from.len())?;
        let mut words = from.as_chunks().0.iter().map(|bytes| u32::from_le_bytes(*bytes));
        let mut head = [0; WORDS];
        head.iter_mut().zip(&mut words).for_each(|(to, word)| *to = word);
        let [magic, version, image, sum, seed, draws, flags, next, old, slot] = head;
        if magic != MAGIC || version != VERSION {
            return Err(SavedError::Version);
        }
        if image != self.image.crc() {
            return Err(SavedError::Image);
        }
        let [next, old, slot] = [next, old, slot].map(|n| n as usize);
        // Without an overlap nothing remains of a previous chunk.
        let remains = if self.image.overlap() > 0 { old <= self.image.chunk() } else { old == self.image.chunk() };
        let is_possible = flags <= 3 && remains && slot < self.image.horizon().max(1);
        if sum != checksum(from) || !is_possible || !self.has_valid_arena(words.clone(), flags & 1 != 0) {
            return Err(SavedError::Damaged);
        }
        for region in self.saved_regions() {
            self.words_mut(region).iter_mut().zip(&mut words).for_each(|(to, word)| *to = word);
        }
        self.phase = Phase::Idle;
        self.playback = Playback { ready: flags & 2 != 0, next, old, slot };
        (self.seed, self.draws, self.started) = (seed, draws, flags & 1 != 0);
        Ok(())
    }

    /// Returns `true` if the last action in the saved words of the arena is one that the contract allows, and every
    /// period of an ensemble has room for another chunk, as after each action. A file's checksum does not tell who wrote it.
    fn has_valid_arena(&self, words: impl Iterator<Item = u32> + Clone, started: bool) -> bool {
        let [state, output, rest] = self.saved_regions();
        let rest_of = |region: Region| {
            let at = state.len + output.len + region.offset.saturating_sub(rest.offset);
            words.clone().skip(at).take(region.len)
        };
        let is_allowed = |(i, word)| {
            let ([_, _, low, high, ..], action) = (self.image.contract_of(i), f32::from_bits(word));
            action.is_finite() && low <= action && action <= high
        };
        let (kept, horizon) = (self.image.kept(), self.image.horizon());
        let counts = Region { offset: kept.end().saturating_sub(horizon), len: horizon };
        (!started || rest_of(self.image.action()).enumerate().all(is_allowed))
            && rest_of(counts).all(|count| (count as usize) < horizon)
    }

    fn check_saved(&self, given: usize) -> Result<(), SavedError> {
        let needed = self.saved_len();
        if given != needed {
            return Err(SavedError::Length { needed, given });
        }
        if let Phase::Begun(_) = self.phase { Err(SavedError::Begun) } else { Ok(()) }
    }

    /// Regions of the arena that are saved.
    pub(super) fn saved_regions(&self) -> [Region; 3] {
        Self::regions_to_save(&self.image)
    }

    /// Regions of an image's arena that are saved.
    pub(super) fn regions_to_save(image: &Image<'_>) -> [Region; 3] {
        let action = image.action().offset;
        let len = image.work().offset.saturating_sub(action);
        #[cfg(not(feature = "attention"))]
        let state = image.state();
        // With the prefix.
        #[cfg(feature = "attention")]
        let state = Region { offset: 0, len: image.observation().offset };
        [state, image.output(), Region { offset: action, len }]
    }
}
