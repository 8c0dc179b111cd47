//! A step that its caller runs operation by operation. Many heads of one image can then run each operation together,
//! and the caller can compute an operation itself.

use super::step::to_next_op;
use super::{Head, Phase};
use crate::error::StepError;
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
}
