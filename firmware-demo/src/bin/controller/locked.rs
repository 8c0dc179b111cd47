//! The safety state machine, shared by loop and tick.

use actq_controller::{Safety, Shared};
use rtic::Mutex;

/// An RTIC resource, whose lock is a priority.
pub(crate) struct Locked<M>(pub(crate) M);

impl<const AXES: usize, M: Mutex<T = Safety<AXES>>> Shared<AXES> for Locked<M> {
    fn with<R>(&mut self, work: impl FnOnce(&mut Safety<AXES>) -> R) -> R {
        self.0.lock(work)
    }
}
