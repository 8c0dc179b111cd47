//! The self-test: an image holds observations and the actions that they must give.

use super::Head;
use crate::cost::budget::Budget;
use crate::error::{Fault, StepError};
use crate::ops::elementwise::copy_le;

impl Head<'_, '_> {
    /// Plays the image's self-test from a reset and compares every action bit for bit; resets again at the end, and
    /// clears the prefix, because the test has its own.
    ///
    /// # Errors
    ///
    /// [`StepError::SelfTest`] with the first self-test step whose bits differ; [`StepError::Damaged`] if the image
    /// has none; [`StepError::Damaged`] and [`StepError::NotFinite`] as for a step.
    pub fn self_test(&mut self) -> Result<(), StepError> {
        self.play_self_test(Self::finish)
    }

    /// Runs [`Self::self_test`] in slices of at most `budget` modelled instructions, as [`Self::poll`] does, or of
    /// [`Self::least_budget`] if that is more. It calls `before` ahead of each slice, so that the caller can feed a
    /// watchdog. As soon as `before` returns `false`, the test ends.
    ///
    /// # Errors
    ///
    /// Those of [`Self::self_test`], and [`StepError::Stale`] if `before` ended the test.
    pub fn self_test_in_slices(&mut self, budget: u32, mut before: impl FnMut() -> bool) -> Result<(), StepError> {
        let budget = budget.max(self.least_budget());
        self.play_self_test(|head| {
            while before() {
                if head.advance(&mut Budget::of_poll(budget), false)? {
                    return Ok(());
                }
            }
            Err(Fault::Stale)
        })
    }

    #[inline(never)]
    fn play_self_test(&mut self, finish: impl FnMut(&mut Self) -> Result<(), Fault>) -> Result<(), StepError> {
        let seed = core::mem::take(&mut self.seed);
        self.reset();
        #[cfg(feature = "attention")]
        self.set_test_prefix();
        let outcome = self.compare_self_test(finish);
        #[cfg(feature = "attention")]
        self.clear_prefix();
        self.seed(seed);
        outcome
    }

    fn compare_self_test(&mut self, mut finish: impl FnMut(&mut Self) -> Result<(), Fault>) -> Result<(), StepError> {
        let mut step = 0;
        while let Some((observation, expected)) = self.image.self_test(step) {
            copy_le(observation, self.words_mut(self.image.observation()));
            self.playback.turn(&self.image, self.arena);
            self.start(true);
            finish(self)?;
            let action = self.floats(self.image.action());
            if action.iter().zip(expected).any(|(a, w)| a.to_bits() != u32::from_le(*w)) {
                return Err(StepError::SelfTest { step });
            }
            step += 1;
        }
        // A test without steps, or that ends before its last one, has tested nothing.
        if step == 0 || step < self.image.self_test_steps() { Err(StepError::Damaged) } else { Ok(()) }
    }
}
