//! A step that its caller runs operation by operation. Many heads of one image can then run each operation together,
//! and the caller can compute an operation itself.

use super::playback::Playback;
use super::step::to_next_op;
use super::{Head, Phase};
use crate::checksum::Checksum;
use crate::error::{HeadError, StepError};
use crate::image::Image;
use crate::meter::Unlimited;

impl Head<'_, '_> {
    /// Begins a step with an observation, as [`Self::step`] does. Then run its operations ([`Self::run_op`] or
    /// [`Self::replace_op`]) while there is a [`Self::next_op`], and finish the step ([`Self::finish_ops`]).
    ///
    /// # Errors
    ///
    /// Those of [`Self::step`] for the observation.
    pub fn begin_ops(&mut self, observation: &[f32]) -> Result<(), StepError> {
        self.take(observation, None)
    }

    /// Returns the index of the operation that the step runs next; `None` if no operation remains. A step that
    /// continues a chunk has none.
    pub fn next_op(&self) -> Option<usize> {
        match self.phase {
            Phase::Begun(cursor) if cursor.op < self.image.op_count() => Some(cursor.op),
            _ => None,
        }
    }

    /// Runs the next operation.
    ///
    /// # Errors
    ///
    /// Those of [`Self::step`], with its effects.
    pub fn run_op(&mut self) -> Result<(), StepError> {
        self.advance(&mut Unlimited, true)?;
        Ok(())
    }

    /// Runs `run` over the arena in place of the next operation. An error of `run` ends the step, with the effects of
    /// an error in [`Self::step`].
    ///
    /// # Errors
    ///
    /// Those of `run`, and [`StepError::NotBegun`].
    pub fn replace_op(&mut self, run: impl FnOnce(&mut [u32]) -> Result<(), StepError>) -> Result<(), StepError> {
        let Phase::Begun(mut cursor) = self.phase else { return Err(StepError::NotBegun) };
        run(self.arena).inspect_err(|_| self.abandon())?;
        to_next_op(&self.image, &mut cursor);
        self.phase = Phase::Begun(cursor);
        Ok(())
    }

    /// Returns the action of a step whose operations have run. It runs those that remain.
    ///
    /// # Errors
    ///
    /// Those of [`Self::step`].
    pub fn finish_ops(&mut self) -> Result<&[f32], StepError> {
        self.finish()?;
        Ok(self.floats(self.image.action()))
    }

    /// Returns the arena, which holds the regions that operations name.
    pub fn arena(&self) -> &[u32] {
        self.arena
    }

    /// Borrows the whole arena, for a test to change it as a fault of the memory would.
    pub fn arena_mut(&mut self) -> &mut [u32] {
        self.arena
    }

    /// Ends the head and keeps what its next steps depend on: the rest of a [`Parked`] is written to `words`, which has
    /// [`Parked::words`]. A step that has begun is dropped, as by [`Self::begin`].
    pub fn park(mut self, words: &mut [u32]) -> Parked {
        self.drop_step();
        let mut rest = words;
        for region in self.saved_regions() {
            let from = self.arena.get(region.range()).unwrap_or_default();
            let Some((to, after)) = core::mem::take(&mut rest).split_at_mut_checked(from.len()) else { break };
            to.copy_from_slice(from);
            rest = after;
        }
        let Self { phase, playback, started, seed, draws, .. } = self;
        Parked { is_ready: matches!(phase, Phase::Ready), playback, started, seed, draws }
    }
}

/// A head between two steps, without the memory that a step works in.
#[derive(Clone, Copy, Debug)]
pub struct Parked {
    is_ready: bool,
    playback: Playback,
    started: bool,
    seed: u32,
    draws: u32,
}

impl Parked {
    /// Returns the words of a parked head of this image.
    pub fn words(image: &Image<'_>) -> usize {
        Head::regions_to_save(image).iter().map(|region| region.len).sum()
    }

    /// Continues a head of this image, which [`Head::park`] wrote to `words`, in any memory.
    ///
    /// # Errors
    ///
    /// [`HeadError::ScratchTooSmall`] if `scratch` has fewer words than [`Image::scratch_words`].
    pub fn resume<'a, 's>(
        self,
        image: Image<'a>,
        words: &[u32],
        scratch: &'s mut [u32],
    ) -> Result<Head<'a, 's>, HeadError> {
        let (needed, given) = (image.scratch_words(), scratch.len());
        if given < needed {
            return Err(HeadError::ScratchTooSmall { needed, given });
        }
        let Self { is_ready, playback, started, seed, draws } = self;
        let phase = if is_ready { Phase::Ready } else { Phase::Idle };
        let resting = Checksum::default();
        let mut head = Head { image, arena: scratch, least_budget: 0, phase, playback, resting, started, seed, draws };
        let mut rest = words;
        for region in head.saved_regions() {
            let to = head.words_mut(region);
            let Some((from, after)) = rest.split_at_checked(to.len()) else { break };
            to.copy_from_slice(from);
            rest = after;
        }
        Ok(head)
    }
}
