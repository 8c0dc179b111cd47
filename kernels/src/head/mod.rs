//! A head: runs an image on observations, in whole steps or in slices, and keeps the recurrent state and the action
//! chunks.

mod contract;
#[cfg(feature = "writer")]
mod lockstep;
mod playback;
#[cfg(feature = "attention")]
mod prefix;
mod saved;
mod self_test;
mod step;
mod watch;

use core::fmt;

#[cfg(feature = "writer")]
pub use self::lockstep::Parked;
use self::playback::Playback;
pub(crate) use self::watch::Watched;
use crate::arena::part;
use crate::checksum::{Checksum, xor};
use crate::cursor::Cursor;
use crate::error::{Fault, HeadError};
use crate::image::{Image, Region};

/// A head: an image and the scratch memory that it runs in.
pub struct Head<'a, 's> {
    image: Image<'a>,
    /// The whole scratch memory; the image's regions are at its start.
    arena: &'s mut [u32],
    /// [`Self::least_budget`]; 0 until it is computed.
    least_budget: u32,
    phase: Phase,
    playback: Playback,
    /// That of the memory between two steps.
    resting: Checksum,
    /// `true` after the first action since the reset; the step limit needs one.
    started: bool,
    /// Seed of the noise.
    seed: u32,
    /// Evaluations since the reset that generated noise.
    draws: u32,
}

/// Not its memory, which a log must not be filled with.
impl fmt::Debug for Head<'_, '_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { image, phase, playback, .. } = self;
        f.debug_struct("Head")
            .field("image", image)
            .field("phase", phase)
            .field("playback", playback)
            .finish_non_exhaustive()
    }
}

/// Progress of a step in the arena.
#[derive(Clone, Copy, Debug)]
enum Phase {
    /// No step has begun.
    Idle,
    /// The arena holds an observation; the cursor is the progress.
    Begun(Cursor),
    /// The arena holds the action.
    Ready,
}

impl<'a, 's> Head<'a, 's> {
    /// Creates a head in `scratch`, which needs at least [`Image::scratch_words`] words; these are zeroed.
    ///
    /// # Errors
    ///
    /// [`HeadError::ScratchTooSmall`] if `scratch` has fewer words.
    pub fn new(image: Image<'a>, scratch: &'s mut [u32]) -> Result<Self, HeadError> {
        let (needed, given) = (image.scratch_words(), scratch.len());
        // No result depends on the previous content of the memory.
        scratch.get_mut(..needed).ok_or(HeadError::ScratchTooSmall { needed, given })?.fill(0);
        let mut playback = Playback::default();
        playback.forget(&image, scratch);
        Ok(Self {
            image,
            arena: scratch,
            least_budget: 0,
            phase: Phase::Idle,
            playback,
            resting: Checksum::default(),
            started: false,
            seed: 0,
            draws: 0,
        })
    }

    /// Ends the head and returns its memory, all that [`Self::new`] was given: for a head of another image.
    pub fn into_scratch(self) -> &'s mut [u32] {
        self.arena
    }

    /// Clears the recurrent state, all chunks, the last action and a step that has begun. The noise of a flow or
    /// diffusion policy starts from the beginning: after a reset the same observations give the same actions. A prefix
    /// stays.
    #[inline(never)]
    pub fn reset(&mut self) {
        self.abandon();
        self.words_mut(self.image.switches()).fill(0);
        self.started = false;
        self.draws = 0;
    }

    /// Sets the seed of a flow or diffusion policy's noise, 0 by default, and resets the head.
    pub fn seed(&mut self, seed: u32) {
        self.seed = seed;
        self.reset();
    }

    /// Resets, but keeps the last action and the state of binarized values: after an error the robot is still where
    /// that action put it, and the step limit starts there.
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

    /// Borrows the recurrent state, to read or to set it: for each operation in order, an LSTM's hidden state and then
    /// its cell state, or a GRU's state. A reset zeroes it.
    pub fn state_mut(&mut self) -> &mut [f32] {
        self.floats_mut(self.image.state())
    }

    /// Returns the image.
    pub fn image(&self) -> &Image<'a> {
        &self.image
    }

    /// Begins a change of the memory that lasts between steps.
    ///
    /// # Errors
    ///
    /// [`Fault::Damaged`] if it changed since the last step; then the step is abandoned.
    fn wake(&mut self) -> Result<(), Fault> {
        let intact = self.resting.check(|| self.sum());
        self.resting = Checksum::default();
        intact.inspect_err(|_| self.abandon())
    }

    /// Ends a change of the memory that lasts between steps.
    fn rest(&mut self) {
        self.resting = Checksum::of(|| self.sum());
    }

    /// Computes the checksum of everything that a saved state has.
    fn sum(&self) -> u32 {
        let Playback { ready, next, old, slot } = self.playback;
        let flags = u32::from(ready) | u32::from(self.started) << 1;
        let fields = flags ^ next as u32 ^ old as u32 ^ slot as u32 ^ self.seed ^ self.draws;
        let of = |region: Region| xor(self.arena.get(region.range()).unwrap_or_default());
        let [state, output, rest] = self.saved_regions();
        fields ^ of(state) ^ of(output) ^ of(rest)
    }

    #[inline(never)]
    fn floats(&self, region: Region) -> &[f32] {
        bytemuck::must_cast_slice(self.arena.get(region.range()).unwrap_or(&[]))
    }

    fn floats_mut(&mut self, region: Region) -> &mut [f32] {
        bytemuck::must_cast_slice_mut(self.words_mut(region))
    }

    fn words_mut(&mut self, region: Region) -> &mut [u32] {
        self.resting = Checksum::default();
        part(self.arena, &region.range())
    }
}
