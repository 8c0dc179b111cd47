//! Steps: an observation in, the network and playback in one piece or several, an action out.

use core::task::Poll;

use super::arena::regions;
use super::executor::run;
use super::{Head, Phase, contract};
use crate::cursor::Cursor;
use crate::error::{Fault, StepError};
use crate::image::Region;
use crate::meter::{Meter, Unlimited, Work};
use crate::ops::elementwise::copy;
use crate::pace::budget::Budget;

impl Head<'_, '_> {
    /// The action for `observation`: of the next chunk position where the image is chunked, after the action contract.
    /// It is [`Self::begin`] and one [`Self::poll`] without a limit. Each action is one control period; [`Self::pass`]
    /// counts those without.
    ///
    /// # Errors
    ///
    /// [`StepError::ObservationLength`] and [`StepError::ObservationNotFinite`] for what is given;
    /// [`StepError::NotFinite`] where a value inside the network leaves f32's range, [`StepError::Damaged`] where the
    /// image's memory has changed since its check, [`StepError::Stale`] where the action is older than its deadline.
    ///
    /// On an error the recurrent state and the chunk are reset, so that no part of a failed evaluation reaches a later
    /// action. The last action stays: the next one is limited by `max_step` as ever.
    #[inline(never)]
    pub fn step(&mut self, observation: &[f32]) -> Result<&[f32], StepError> {
        self.take(observation, None)?;
        self.finish()?;
        Ok(self.floats(self.image.action()))
    }

    /// Begins a step: takes the observation. The work itself is done by [`Self::poll`].
    ///
    /// A step that was begun and is not ready is dropped. If a poll has already worked on it, the recurrent state may
    /// be partly that of the dropped step, and is zeroed as by [`Self::reset`]; the last action stays, so that the step
    /// limit holds.
    ///
    /// Errors are those of [`Self::step`]. The first call takes longer where [`Self::least_budget`] was not called
    /// before.
    pub fn begin(&mut self, observation: &[f32]) -> Result<(), StepError> {
        self.least_budget();
        self.take(observation, None)
    }

    /// [`crate::Image::least_budget`], computed once, which takes about as long as a short step. (Not by [`Self::new`]:
    /// where steps are not cut, the cost model is not in the program.)
    pub fn least_budget(&mut self) -> u32 {
        if self.least_budget == 0 {
            self.least_budget = self.image.least_budget();
        }
        self.least_budget
    }

    /// Runs at most `budget` instructions of the step that was begun, by the cost model ([`crate::Image::step_cost`]), and
    /// gives the action once it is ready; then, again and again until the next [`Self::begin`]. Steps that play on from
    /// a chunk have little to do, and are ready at the first poll. A budget of 2^28 or more is no limit.
    ///
    /// The cost model is that of the build for thumbv7em-none-eabihf; elsewhere pieces are cut in the same places.
    /// However a step is cut, its bits are the same.
    ///
    /// # Errors
    ///
    /// [`StepError::Budget`] where `budget` is below [`crate::Image::least_budget`], and [`StepError::NotBegun`],
    /// change nothing. Others are those of [`Self::step`].
    pub fn poll(&mut self, budget: u32) -> Result<Poll<&[f32]>, StepError> {
        self.poll_until(budget, false)
    }

    /// As [`Self::poll`], but also stops behind each of the image's operations: to measure them one by one.
    pub fn poll_op(&mut self, budget: u32) -> Result<Poll<&[f32]>, StepError> {
        self.poll_until(budget, true)
    }

    /// Lets so many control periods pass without an action: the observation of a step that was begun is so much older
    /// when it is ready, and the actions that were for these periods never play. (So an observation that is old when it
    /// comes: first [`Self::begin`], then its age.) Where nothing is left that is younger than the image's deadline,
    /// the step ends with [`StepError::Stale`].
    pub fn pass(&mut self, periods: usize) {
        self.playback.pass(&self.image, self.arena, periods);
    }

    /// The action that is due by what chunks have foreseen, without an observation: while a step is being computed, so
    /// that the next chunk goes on behind what has been played, or where an observation is missing. Of a chunk that is
    /// being replaced, only an image with an overlap or an ensemble keeps what is left.
    ///
    /// # Errors
    ///
    /// [`StepError::Stale`] where nothing is left, or nothing young enough, which changes nothing. Others are those of
    /// [`Self::step`].
    #[inline(never)]
    pub fn play(&mut self) -> Result<&[f32], StepError> {
        if let Err(fault) = self.act() {
            if fault != Fault::Stale {
                self.abandon();
            }
            return Err(fault.into());
        }
        Ok(self.floats(self.image.action()))
    }

    /// The network's raw output for `observation` (`chunk * act_len` values), before the action contract. Advances the
    /// recurrent state, and drops what was left of a chunk or of a step that was begun.
    ///
    /// # Errors
    ///
    /// Those of [`Self::step`], but for [`StepError::Stale`]: nothing is played.
    pub fn infer(&mut self, observation: &[f32]) -> Result<&[f32], StepError> {
        self.infer_from(observation, None)
    }

    /// As [`Self::infer`], with the noise of an iterative head from the caller: [`crate::Image::noise_len`] values, the
    /// first iterate, followed by the noise of each denoising step if the steps add noise.
    ///
    /// # Errors
    ///
    /// [`StepError::NoiseLength`], [`StepError::NoiseNotFinite`], and those of [`Self::infer`].
    pub fn infer_with_noise(&mut self, observation: &[f32], noise: &[f32]) -> Result<&[f32], StepError> {
        self.infer_from(observation, Some(noise))
    }

    #[inline(never)]
    fn infer_from(&mut self, observation: &[f32], noise: Option<&[f32]>) -> Result<&[f32], StepError> {
        self.drop_step();
        // From the first operation on, whatever is left of a chunk.
        self.playback.forget(&self.image, self.arena);
        self.take(observation, noise)?;
        self.evaluate(&mut Unlimited, false).inspect_err(|_| self.abandon())?;
        self.phase = Phase::Idle;
        Ok(self.floats(self.image.output()))
    }

    #[inline(never)]
    pub(super) fn take(&mut self, observation: &[f32], noise: Option<&[f32]>) -> Result<(), StepError> {
        self.drop_step();
        self.load(observation).inspect_err(|_| self.abandon())?;
        self.playback.turn(&self.image, self.arena);
        if let Some(noise) = noise {
            self.load_noise(noise).inspect_err(|_| self.abandon())?;
        }
        self.start(noise.is_none());
        Ok(())
    }

    /// See [`Self::begin`].
    fn drop_step(&mut self) {
        if let Phase::Begun(cursor) = self.phase
            && cursor.has_left(self.fresh())
        {
            self.forget();
        }
        self.phase = Phase::Idle;
    }

    /// Where a step begins: before the first operation, or, within a chunk, behind the last.
    fn fresh(&self) -> Cursor {
        Cursor { op: if self.playback.ready { self.image.op_count() } else { 0 }, ..Cursor::default() }
    }

    /// Checks the observation and puts it into the arena.
    fn load(&mut self, observation: &[f32]) -> Result<(), StepError> {
        let (expected, given) = (self.image.obs_len(), observation.len());
        if expected != given {
            return Err(StepError::ObservationLength { expected, given });
        }
        if let Some(index) = observation.iter().position(|v| !v.is_finite()) {
            return Err(StepError::ObservationNotFinite { index });
        }
        let region = self.image.observation();
        copy(bytemuck::must_cast_slice(observation), self.arena.get_mut(region.range()).ok_or(StepError::Damaged)?);
        Ok(())
    }

    /// Checks the noise and puts it into the arena; within a chunk, whose values may stand there, only checks it.
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

    /// Begins a step with the observation that the arena holds, and with noise of the generator or with that of the
    /// arena.
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

    /// Takes the step that was begun to its end.
    pub(super) fn finish(&mut self) -> Result<(), Fault> {
        self.advance(&mut Unlimited, false)?;
        Ok(())
    }

    /// Goes on as far as the budget reaches; true when the action is ready. On an error the step is abandoned.
    pub(super) fn advance(&mut self, budget: &mut impl Meter, one_op: bool) -> Result<bool, Fault> {
        self.go_on(budget, one_op).inspect_err(|_| self.abandon())
    }

    fn go_on(&mut self, budget: &mut impl Meter, one_op: bool) -> Result<bool, Fault> {
        if let Phase::Begun(_) = self.phase {
            if !self.evaluate(budget, one_op)? || budget.take(1, Work::Act(&self.image)) == 0 {
                return Ok(false);
            }
            if !self.playback.ready {
                self.playback.merge(&self.image, self.arena)?;
            }
            self.act()?;
            self.phase = Phase::Ready;
        }
        Ok(true)
    }

    /// Runs operations from where the step stands; true behind the last one.
    #[inline(never)]
    fn evaluate(&mut self, budget: &mut impl Meter, one_op: bool) -> Result<bool, Fault> {
        let Phase::Begun(cursor) = &mut self.phase else { return Ok(true) };
        while cursor.op < self.image.op_count() {
            let done = match &self.image.op(cursor.op) {
                Ok(op) if budget.take(1, Work::Enter(op)) > 0 => run(op, self.arena, cursor, budget),
                Ok(_) => Ok(false),
                // In a checked image every record parses.
                Err(_) => Err(Fault::Damaged),
            };
            if done != Ok(true) {
                return done;
            }
            let Cursor { mut op, mut step, draw, .. } = *cursor;
            op += 1;
            if op == self.image.op_count() && step + 1 < self.image.denoising_steps() {
                (op, step) = (self.image.once(), step + 1);
            }
            *cursor = Cursor { op, step, draw, ..Cursor::default() };
            if one_op {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Takes the action that is due through the contract. Not inlined, so that the operations do not run on top of its
    /// stack.
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
