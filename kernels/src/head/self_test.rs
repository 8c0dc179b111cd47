//! The self-test: an image brings observations and the actions that they must give.

use super::Head;
use crate::error::StepError;
use crate::ops::elementwise::copy_le;

impl Head<'_, '_> {
    /// Plays the image's self-test vector from a reset and compares every action bit for bit; resets again at the end.
    ///
    /// # Errors
    ///
    /// [`StepError::SelfTest`] with the first step whose bits differ; [`StepError::Damaged`] and [`StepError::NotFinite`] as of a step.
    #[inline(never)]
    pub fn self_test(&mut self) -> Result<(), StepError> {
        let seed = core::mem::take(&mut self.seed);
        self.reset();
        let outcome = self.play_self_test();
        self.seed(seed);
        outcome
    }

    fn play_self_test(&mut self) -> Result<(), StepError> {
        let mut step = 0;
        while let Some((observation, expected)) = self.image.self_test(step) {
            copy_le(observation, self.words_mut(self.image.observation()));
            self.playback.turn(&self.image, self.arena);
            self.start(true);
            self.finish()?;
            let action = self.floats(self.image.action());
            if action.iter().zip(expected).any(|(a, w)| a.to_bits() != u32::from_le(*w)) {
                return Err(StepError::SelfTest { step });
            }
            step += 1;
        }
        Ok(())
    }
}
