//! Steps: an observation in, the network and playback in one slice or several, an action out.

use core::task::Poll;

use super::watch::run_watched;
use super::{Head, Phase, contract};
use crate::arena::regions;
use crate::checksum::Checksum;
use crate::cost::budget::Budget;
use crate::cursor::Cursor;
use crate::error::{Fault, StepError};
use crate::image::{Image, Region};
use crate::meter::{Meter, Unlimited, Work};
use crate::ops::elementwise::copy;

impl Head<'_, '_> {
    /// Computes the action for `observation`, after the action contract; with action chunks, the chunk's next action.
    /// It is [`Self::begin`] and one [`Self::poll`] without a limit. Each action counts as one control period;
    /// [`Self::pass`] counts periods without an action.
    ///
    /// # Errors
    ///
    /// [`StepError::ObservationLength`], [`StepError::ObservationNotFinite`] and [`StepError::ObservationRange`] for
    /// the observation; [`StepError::NotFinite`] if a value inside the network exceeds f32's range;
    /// [`StepError::Damaged`] if the image has changed since its check, or scratch memory between two steps or during
    /// one (feature `checksums`); [`StepError::Stale`] if the action is older than its deadline;
    /// [`StepError::Orientation`] if the image reads a quaternion whose length is not near 1; [`StepError::NoPrefix`]
    /// if the network must run and its prefix is missing.
    ///
    /// An error resets the recurrent state and the chunk, so that no part of a failed evaluation reaches a later
    /// action. The last action stays, and `max_step` limits the next one from it.
    #[inline(never)]
    pub fn step(&mut self, observation: &[f32]) -> Result<&[f32], StepError> {
        self.take(observation, None)?;
        self.finish()?;
        Ok(self.floats(self.image.action()))
    }

    /// Begins a step with an observation. [`Self::poll`] does the work.
    ///
    /// It drops a step that has begun and is not ready. If a poll has already worked on that step, the recurrent state
    /// may be partly updated, and is zeroed as by [`Self::reset`]; the last action stays, so that the step limit holds.
    ///
    /// The first call takes longer if [`Self::least_budget`] was not called before.
    ///
    /// # Errors
    ///
    /// Those of [`Self::step`] for the observation.
    pub fn begin(&mut self, observation: &[f32]) -> Result<(), StepError> {
        self.least_budget();
        self.take(observation, None)
    }

    /// Returns [`crate::Image::least_budget`]. The first call computes it, which takes about as long as a short step.
    /// ([`Self::new`] does not: a program that never polls does not include the cost model.)
    pub fn least_budget(&mut self) -> u32 {
        if self.least_budget == 0 {
            self.least_budget = self.image.least_budget();
        }
        self.least_budget
    }

    /// Runs a slice of the step that has begun: at most `budget` instructions by the cost model
    /// ([`crate::Image::step_cost`]). It returns the action as soon as it is ready. Without a step that has begun, it
    /// returns the last action again, however old, and fails if there is none since the start, a reset or an error. A
    /// step that continues a chunk has little to do and is ready at the first poll. A budget of 2^28 or more is no
    /// limit.
    ///
    /// The cost model is that of the build for thumbv7em-none-eabihf; on other targets a step is cut in the same
    /// places. However a step is cut, its bits are the same.
    ///
    /// # Errors
    ///
    /// [`StepError::Budget`] if `budget` is below [`crate::Image::least_budget`] (after the first [`Self::begin`]), and
    /// [`StepError::NotBegun`]; both change nothing. All others are those of [`Self::step`].
    pub fn poll(&mut self, budget: u32) -> Result<Poll<&[f32]>, StepError> {
        self.poll_until(budget, false)
    }

    /// Runs a slice as [`Self::poll`] does, and also stops after each operation of the image: to measure them one by
    /// one.
    ///
    /// # Errors
    ///
    /// Those of [`Self::poll`].
    pub fn poll_op(&mut self, budget: u32) -> Result<Poll<&[f32]>, StepError> {
        self.poll_until(budget, true)
    }

    /// Lets `periods` control periods pass without an action. The actions for these periods never play, and the
    /// observation of a step that has begun ages by as much. (For an observation that is already old, call
    /// [`Self::begin`], then this with its age.) If no action younger than the image's deadline remains, the step ends
    /// with [`StepError::Stale`].
    pub fn pass(&mut self, periods: usize) {
        self.resting = Checksum::default();
        self.playback.pass(&self.image, self.arena, periods);
    }

    /// Plays the next action that chunks predict, without an observation. Call it while a step is being computed, so
    /// that the next chunk continues after the actions that have played, or when an observation is missing. While a
    /// chunk is being replaced, only an image with an overlap or a temporal ensemble keeps the rest of it.
    ///
    /// # Errors
    ///
    /// [`StepError::Stale`] if no action remains, or none young enough; it changes nothing. All others are those of
    /// [`Self::step`].
    #[inline(never)]
    pub fn play(&mut self) -> Result<&[f32], StepError> {
        self.wake()?;
        if let Err(fault) = self.act() {
            if fault != Fault::Stale {
                self.abandon();
            }
            return Err(fault.into());
        }
        if !matches!(self.phase, Phase::Begun(_)) {
            self.rest();
        }
        Ok(self.floats(self.image.action()))
    }

    /// Computes the network's raw output for `observation` (`chunk * act_len` values), before the action contract.
    /// Values that overflowed are NaN or infinite, not an error. It advances the recurrent state, and drops the rest of
    /// a chunk and a step that has begun.
    ///
    /// # Errors
    ///
    /// Those of [`Self::step`] for the observation, and [`StepError::Damaged`].
    pub fn infer(&mut self, observation: &[f32]) -> Result<&[f32], StepError> {
        self.infer_from(observation, None)
    }

    /// Runs [`Self::infer`] with noise from the caller, for a flow or diffusion policy: [`crate::Image::noise_len`]
    /// values, the first iterate, followed by the noise of each denoising step if the steps add noise.
    ///
    /// # Errors
    ///
    /// [`StepError::NoiseLength`], [`StepError::NoiseNotFinite`], and those of [`Self::infer`].
    pub fn infer_with_noise(&mut self, observation: &[f32], noise: &[f32]) -> Result<&[f32], StepError> {
        self.infer_from(observation, Some(noise))
    }

    #[inline(never)]
    fn infer_from(&mut self, observation: &[f32], noise: Option<&[f32]>) -> Result<&[f32], StepError> {
        self.wake()?;
        self.drop_step();
        // From the first operation on, whatever remains of a chunk.
        self.playback.forget(&self.image, self.arena);
        self.take(observation, noise)?;
        self.evaluate(&mut Unlimited, false).inspect_err(|_| self.abandon())?;
        self.phase = Phase::Idle;
        Ok(self.floats(self.image.output()))
    }

    #[inline(never)]
    pub(super) fn take(&mut self, observation: &[f32], noise: Option<&[f32]>) -> Result<(), StepError> {
        self.wake()?;
        self.drop_step();
        self.load(observation).inspect_err(|_| self.abandon())?;
        self.playback.turn(&self.image, self.arena);
        #[cfg(feature = "attention")]
        if !self.playback.ready && !self.has_prefix() {
            self.abandon();
            return Err(StepError::NoPrefix);
        }
        if let Some(noise) = noise {
            self.load_noise(noise).inspect_err(|_| self.abandon())?;
        }
        self.start(noise.is_none());
        Ok(())
    }

    /// Drops a step that has begun: see [`Self::begin`].
    pub(super) fn drop_step(&mut self) {
        if let Phase::Begun(cursor) = self.phase
            && cursor.has_progressed(self.fresh())
        {
            self.forget();
        }
        self.phase = Phase::Idle;
    }

    /// Returns the start of a step: before the first operation, or, within a chunk, after the last.
    fn fresh(&self) -> Cursor {
        Cursor { op: if self.playback.ready { self.image.op_count() } else { 0 }, ..Cursor::default() }
    }

    /// Checks the observation and copies it to the arena.
    fn load(&mut self, observation: &[f32]) -> Result<(), StepError> {
        let (expected, given) = (self.image.obs_len(), observation.len());
        if expected != given {
            return Err(StepError::ObservationLength { expected, given });
        }
        if let Some(index) = observation.iter().position(|v| !v.is_finite()) {
            return Err(StepError::ObservationNotFinite { index });
        }
        let mut rest = observation;
        for (len, [low, high]) in self.image.input_ranges() {
            let Some((values, after)) = rest.split_at_checked(len) else { break };
            if let Some(i) = values.iter().position(|value| !(low..=high).contains(value)) {
                return Err(StepError::ObservationRange { index: expected - rest.len() + i });
            }
            rest = after;
        }
        let region = self.image.observation();
        copy(bytemuck::must_cast_slice(observation), self.arena.get_mut(region.range()).ok_or(StepError::Damaged)?);
        Ok(())
    }

    /// Checks the noise and copies it to the arena. Within a chunk it only checks: the arena may hold the chunk's
    /// values.
    #[inline(never)]
    fn load_noise(&mut self, noise: &[f32]) -> Result<(), StepError> {
        let region = self.image.noise();
        if region.len != noise.len() {
            return Err(StepError::NoiseLength { expected: region.len, given: noise.len() });
        }
        if let Some(index) = noise.iter().position(|v| !v.is_finite()) {
            return Err(StepError::NoiseNotFinite { index });
        }
        if !self.playback.ready {
            copy(bytemuck::must_cast_slice(noise), self.words_mut(region));
        }
        Ok(())
    }

    /// Begins a step with the observation in the arena, and with noise from the generator (`draw`) or from the arena.
    #[inline(never)]
    pub(super) fn start(&mut self, draw: bool) {
        let draw = draw.then_some([self.seed, self.draws]);
        if !self.playback.ready && draw.is_some() {
            self.draws = self.draws.wrapping_add(1);
        }
        self.phase = Phase::Begun(Cursor { draw, ..self.fresh() });
    }

    fn poll_until(&mut self, budget: u32, one_op: bool) -> Result<Poll<&[f32]>, StepError> {
        if budget < self.least_budget {
            return Err(StepError::Budget { needed: self.least_budget, given: budget });
        }
        if let Phase::Idle = self.phase {
            return Err(StepError::NotBegun);
        }
        let ready = self.advance(&mut Budget::of_poll(budget), one_op)?;
        Ok(if ready { Poll::Ready(self.floats(self.image.action())) } else { Poll::Pending })
    }

    /// Runs the step that has begun to its end.
    pub(super) fn finish(&mut self) -> Result<(), Fault> {
        self.advance(&mut Unlimited, false)?;
        Ok(())
    }

    /// Continues as far as the budget allows; returns `true` when the action is ready. An error abandons the step.
    pub(super) fn advance(&mut self, budget: &mut impl Meter, one_op: bool) -> Result<bool, Fault> {
        self.proceed(budget, one_op).inspect_err(|_| self.abandon())
    }

    fn proceed(&mut self, budget: &mut impl Meter, one_op: bool) -> Result<bool, Fault> {
        if let Phase::Begun(_) = self.phase {
            if !self.evaluate(budget, one_op)? || budget.take(1, Work::Act(&self.image)) == 0 {
                return Ok(false);
            }
            if !self.playback.ready {
                self.playback.merge(&self.image, self.arena)?;
            }
            self.act()?;
            self.phase = Phase::Ready;
            self.rest();
        }
        Ok(true)
    }

    /// Runs operations from the step's cursor on; returns `true` after the last one.
    #[inline(never)]
    fn evaluate(&mut self, budget: &mut impl Meter, one_op: bool) -> Result<bool, Fault> {
        let Phase::Begun(cursor) = &mut self.phase else { return Ok(true) };
        while cursor.op < self.image.op_count() {
            let done = match &self.image.op(cursor.op) {
                Ok(op) if budget.take(1, Work::Enter(op)) > 0 => {
                    run_watched(&self.image, op, self.arena, cursor, budget)
                }
                Ok(_) => Ok(false),
                // In a checked image every record parses.
                Err(_) => Err(Fault::Damaged),
            };
            if done != Ok(true) {
                return done;
            }
            to_next_op(&self.image, cursor);
            if one_op {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Applies the contract to the next action. Not inlined, so that its stack frame is gone while operations run.
    #[inline(never)]
    fn act(&mut self) -> Result<(), Fault> {
        let due = self.playback.due(&self.image, self.arena)?;
        let places = [due, self.image.action(), self.image.switches()];
        let [next, action, switches, _] = regions(self.arena, &places, Region::default());
        if next.is_empty() {
            return Err(Fault::Damaged);
        }
        contract::apply(&self.image, next, action, switches, self.started)?;
        self.started = true;
        self.playback.pass(&self.image, self.arena, 1);
        Ok(())
    }
}

/// Moves the cursor to the start of the operation after its own.
#[inline(always)]
pub(super) fn to_next_op(image: &Image<'_>, cursor: &mut Cursor) {
    let Cursor { mut op, mut step, draw, .. } = *cursor;
    op += 1;
    if op == image.op_count() && step + 1 < image.denoising_steps() {
        (op, step) = (image.first_denoising_op(), step + 1);
    }
    *cursor = Cursor { op, step, draw, ..Cursor::default() };
}
