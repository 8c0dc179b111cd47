//! A head: runs an image on observations, a step at once or in pieces, and keeps the recurrent state and the chunk
//! queue.

mod arena;
mod contract;
mod executor;
mod playback;
mod saved;
mod self_test;
mod step;

use self::arena::part;
#[cfg(feature = "writer")]
pub use self::executor::run_whole;
use self::playback::Playback;
use crate::cursor::Cursor;
use crate::error::HeadError;
use crate::image::{Image, Region};

/// A head: an image and the scratch memory that it runs in.
#[derive(Debug)]
pub struct Head<'a, 's> {
    image: Image<'a>,
    arena: &'s mut [u32],
    /// [`Self::least_budget`], once it was computed; 0 before.
    least_budget: u32,
    phase: Phase,
    playback: Playback,
    /// Whether an action has been given since the reset, so that the step limit has something to hold on to.
    started: bool,
    /// Of the noise.
    seed: u32,
    /// Evaluations since the reset that drew noise.
    draws: u32,
}

/// What the arena holds of a step.
#[derive(Clone, Copy, Debug)]
enum Phase {
    /// Nothing.
    Idle,
    /// An observation, and what has been done with it.
    Begun(Cursor),
    /// The action.
    Ready,
}

impl<'a, 's> Head<'a, 's> {
    /// Takes `scratch`, of at least [`Image::scratch_words`] words, which it zeroes.
    ///
    /// # Errors
    ///
    /// [`HeadError::ScratchTooSmall`] where it has fewer.
    pub fn new(image: Image<'a>, scratch: &'s mut [u32]) -> Result<Self, HeadError> {
        let (needed, given) = (image.scratch_words(), scratch.len());
        let arena = scratch.get_mut(..needed).ok_or(HeadError::ScratchTooSmall { needed, given })?;
        // Nothing depends on what the memory held.
        arena.fill(0);
        let mut playback = Playback::default();
        playback.forget(&image, arena);
        Ok(Self { image, arena, least_budget: 0, phase: Phase::Idle, playback, started: false, seed: 0, draws: 0 })
    }

    /// Forgets the recurrent state, all chunks, the last action and a step that was begun. The noise of an iterative
    /// head begins anew: after a reset the same observations give the same actions.
    #[inline(never)]
    pub fn reset(&mut self) {
        self.abandon();
        self.words_mut(self.image.switches()).fill(0);
        self.started = false;
        self.draws = 0;
    }

    /// The seed of an iterative head's noise, 0 until it is set, and a reset.
    pub fn seed(&mut self, seed: u32) {
        self.seed = seed;
        self.reset();
    }

    /// As [`Self::reset`], but the last action stays, and what is on: after an error the robot is still where that left
    /// it, and the step limit holds on to it.
    #[inline(never)]
    fn abandon(&mut self) {
        self.forget();
        self.phase = Phase::Idle;
        self.playback.forget(&self.image, self.arena);
    }

    /// Zeroes the recurrent state.
    #[inline(never)]
    fn forget(&mut self) {
        self.words_mut(self.image.state()).fill(0);
    }

    /// The recurrent state, to read or to set: of each operation in order an LSTM's hidden, then cell state, or a GRU's
    /// state. A reset zeroes it.
    pub fn state_mut(&mut self) -> &mut [f32] {
        self.floats_mut(self.image.state())
    }

    /// The image.
    pub fn image(&self) -> &Image<'a> {
        &self.image
    }

    #[inline(never)]
    fn floats(&self, region: Region) -> &[f32] {
        bytemuck::must_cast_slice(self.arena.get(region.range()).unwrap_or(&[]))
    }

    fn floats_mut(&mut self, region: Region) -> &mut [f32] {
        bytemuck::must_cast_slice_mut(self.words_mut(region))
    }

    fn words_mut(&mut self, region: Region) -> &mut [u32] {
        part(self.arena, &region.range())
    }
}
