//! Image updates, on boards with memory for them.

use actq_boards::hal::Watchdog;
#[cfg(feature = "attention")]
use actq_controller::prefix::Transfer;
use actq_controller::slots::{Authority, Candidate, Layout, Slot, Slots, Updater, Work};
use actq_controller::update::{NoUpdate, Plan, Update};
use actq_link::code::Refusal;
use embedded_storage::nor_flash::NorFlash;

#[cfg(feature = "attention")]
use crate::running::Running;

/// Two image slots, if the board has them.
pub struct Updates<F, A: Authority>(Option<Updater<F, A>>);

impl<F: NorFlash, A: Authority> Updates<F, A> {
    /// Uses the two halves of `flash` as slots, and selects the image to run: of this `build`, accepted by `authority`
    /// and passed by `test`. Without room for two slots or without an authority, updates are not supported. It feeds the watchdog
    /// before each piece ([`Slots::select`]), and passes it to the test.
    pub fn new<W: Watchdog>(
        flash: F,
        authority: Option<A>,
        build: u32,
        watchdog: &mut W,
        mut test: impl FnMut(&Candidate, &mut W) -> bool,
    ) -> (Self, Option<Candidate>) {
        let Some(authority) = authority else { return (Self(None), None) };
        let middle = (flash.capacity() / 2) as u32;
        let Ok(layout) = Layout::new(&flash, 0..middle, middle..2 * middle) else { return (Self(None), None) };
        let mut slots = Slots::new(flash, layout, authority, build);
        let running = loop {
            let Some(candidate) = slots.select(|| watchdog.feed()) else { break None };
            if test(&candidate, watchdog) && slots.confirm(candidate.slot) {
                break Some(candidate);
            }
            slots.reject(candidate.slot);
        };
        (Self(Some(Updater::new(slots, running.map(|candidate| candidate.slot)))), running)
    }

    /// Returns `true` if the next [`Self::work`] takes long ([`Updater::takes_long`]).
    pub fn takes_long(&self) -> bool {
        self.0.as_ref().is_some_and(Updater::takes_long)
    }

    /// Does a piece of an update's work. Returns an image that waits for its test; pass the outcome to
    /// [`Self::tested`].
    pub fn work(&mut self) -> Option<Candidate> {
        match self.0.as_mut()?.work() {
            Work::Test(candidate) => Some(candidate),
            Work::Idle | Work::More => None,
        }
    }

    /// Takes the outcome of a test; returns `true` if the tested image runs from now on.
    pub fn tested(&mut self, outcome: Result<(), Refusal>) -> bool {
        self.0.as_mut().is_some_and(|updater| updater.tested(outcome))
    }

    /// Returns the slot of the running image; `None` if it is built in.
    pub fn running(&self) -> Option<Slot> {
        self.0.as_ref()?.running()
    }
}

impl<F: NorFlash, A: Authority> Update for Updates<F, A> {
    fn begin(&mut self, plan: Plan) -> Result<(), Refusal> {
        self.0.as_mut().map_or_else(|| NoUpdate.begin(plan), |updater| updater.begin(plan))
    }

    fn chunk(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Refusal> {
        self.0.as_mut().map_or_else(|| NoUpdate.chunk(offset, bytes), |updater| updater.chunk(offset, bytes))
    }

    fn commit(&mut self, signature: Option<&[u8; 64]>) -> Result<(), Refusal> {
        self.0.as_mut().map_or_else(|| NoUpdate.commit(signature), |updater| updater.commit(signature))
    }

    fn abort(&mut self) -> Result<(), Refusal> {
        self.0.as_mut().map_or(Ok(()), Update::abort)
    }

    fn written(&self) -> u32 {
        self.0.as_ref().map_or(0, Update::written)
    }

    fn is_busy(&self) -> bool {
        self.0.as_ref().is_some_and(Update::is_busy)
    }
}

/// Image updates, and the prefix of the running image.
#[cfg(feature = "attention")]
pub(crate) struct Both<'w, 'i, 's, F, A: Authority> {
    pub(crate) updates: &'w mut Updates<F, A>,
    pub(crate) running: &'w mut Option<Running<'i, 's>>,
}

#[cfg(feature = "attention")]
impl<F: NorFlash, A: Authority> Update for Both<'_, '_, '_, F, A> {
    fn begin(&mut self, plan: Plan) -> Result<(), Refusal> {
        self.updates.begin(plan)
    }

    fn chunk(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Refusal> {
        self.updates.chunk(offset, bytes)
    }

    fn commit(&mut self, signature: Option<&[u8; 64]>) -> Result<(), Refusal> {
        self.updates.commit(signature)
    }

    fn abort(&mut self) -> Result<(), Refusal> {
        self.updates.abort()
    }

    fn written(&self) -> u32 {
        self.updates.written()
    }

    fn is_busy(&self) -> bool {
        self.updates.is_busy()
    }

    fn with_prefix<T>(&mut self, run: impl FnOnce(&mut Transfer<'_>) -> T) -> Option<T> {
        self.running.as_mut().map(|running| run(&mut running.transfer))
    }
}
