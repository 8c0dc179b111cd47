//! The prefix of a head: keys and values that come from its caller, as those of a large model on the host, and that the
//! image's attentions read. It is an input, like an observation: a reset keeps it.

use super::{Head, Phase};
use crate::error::PrefixError;

impl Head<'_, '_> {
    /// Sets the prefix: [`crate::Image::prefix_bytes`] bytes, which are the words of [`crate::Image::prefix_caches`] one
    /// after the other, little-endian ([`crate::Cache::fill`] makes them). It is used until the next call, or
    /// [`Self::clear_prefix`]. The head does not know its age: a caller that must not use an old one clears it.
    ///
    /// # Errors
    ///
    /// [`PrefixError`]: the head keeps its prefix.
    pub fn set_prefix(&mut self, prefix: &[u8]) -> Result<(), PrefixError> {
        let (needed, given) = (self.image.prefix_bytes(), prefix.len());
        if needed != given {
            return Err(PrefixError::Length { needed, given });
        }
        if let Phase::Begun(_) = self.phase {
            return Err(PrefixError::Begun);
        }
        let words = prefix.as_chunks().0;
        let mut rest = words;
        for cache in self.image.prefix_caches() {
            let (this, after) = rest.split_at_checked(cache.words()).unwrap_or_default();
            let (count, after_count) = this.split_first().ok_or(PrefixError::Tokens)?;
            if !(1..=cache.prefix_slots()).contains(&(u32::from_le_bytes(*count) as usize)) {
                return Err(PrefixError::Tokens);
            }
            let scales = after_count.iter().take(cache.scales());
            // Magnitudes compare as their bits; a sign bit is above all of them.
            if scales.map(|scale| u32::from_le_bytes(*scale)).any(|scale| scale >= f32::INFINITY.to_bits()) {
                return Err(PrefixError::NotFinite);
            }
            rest = after;
        }
        for (to, word) in self.words_mut(self.image.prefix()).iter_mut().zip(words) {
            *to = u32::from_le_bytes(*word);
        }
        Ok(())
    }

    /// Clears the prefix, and drops a step that has begun, as an error does. Until the next prefix, steps that run the
    /// network fail with [`crate::StepError::NoPrefix`].
    pub fn clear_prefix(&mut self) {
        self.words_mut(self.image.prefix()).fill(0);
        if let Phase::Begun(_) = self.phase {
            self.abandon();
        }
    }

    /// Returns `true` if the head has the prefix that its image needs, or if the image needs none.
    pub fn has_prefix(&self) -> bool {
        // A cache of a prefix has at least one token, and the count comes first.
        self.arena.get(self.image.prefix().range()).is_none_or(|words| words.first() != Some(&0))
    }

    /// Sets the prefix of the self-test: the same for every image with the same caches.
    pub fn set_test_prefix(&mut self) {
        let region = self.image.prefix();
        let words = self.words_mut(region);
        // A full-period generator of 2^32 numbers, with the constants of Numerical Recipes.
        let mut last = 0u32;
        for word in words {
            last = last.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            *word = last;
        }
        let mut at = region.offset;
        for cache in self.image.prefix_caches() {
            if let Some((count, rest)) = self.arena.get_mut(at..).and_then(<[u32]>::split_first_mut) {
                *count = cache.prefix_slots() as u32;
                rest.iter_mut().take(cache.scales()).for_each(|scale| *scale = (1.0f32 / 128.0).to_bits());
            }
            at = at.wrapping_add(cache.words());
        }
    }
}
