//! A controller without image updates, which may receive a prefix.

#[cfg(feature = "prefix")]
use actq_controller::prefix::Transfer;
use actq_controller::update::{NoUpdate, Plan, Update};
use actq_link::code::Refusal;

/// Receives a prefix, if one is expected.
#[derive(Default)]
pub(super) struct Receives {
    #[cfg(feature = "prefix")]
    pub(super) transfer: Option<Transfer<'static>>,
}

impl Update for Receives {
    fn begin(&mut self, plan: Plan) -> Result<(), Refusal> {
        NoUpdate.begin(plan)
    }

    fn chunk(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Refusal> {
        NoUpdate.chunk(offset, bytes)
    }

    fn commit(&mut self, signature: Option<&[u8; 64]>) -> Result<(), Refusal> {
        NoUpdate.commit(signature)
    }

    fn abort(&mut self) -> Result<(), Refusal> {
        NoUpdate.abort()
    }

    fn written(&self) -> u32 {
        NoUpdate.written()
    }

    fn is_busy(&self) -> bool {
        NoUpdate.is_busy()
    }

    #[cfg(feature = "prefix")]
    fn with_prefix<T>(&mut self, run: impl FnOnce(&mut Transfer<'_>) -> T) -> Option<T> {
        self.transfer.as_mut().map(run)
    }
}
