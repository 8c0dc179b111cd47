//! The safety state machine, shared by loop and tick.

use actq_controller::{Safety, Shared};
use rtic_core::Mutex;

/// A resource, whose lock is a priority (RTIC) or disables interrupts.
pub(crate) struct Locked<M>(pub(crate) M);

impl<const AXES: usize, M: Mutex<T = Safety<AXES>>> Shared<AXES> for Locked<M> {
    fn with<R>(&mut self, work: impl FnOnce(&mut Safety<AXES>) -> R) -> R {
        self.0.lock(work)
    }
}
