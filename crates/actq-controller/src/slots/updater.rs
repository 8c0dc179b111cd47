//! An update, from its announcement to the running image.

use actq_link::code::Refusal;
use embedded_storage::nor_flash::NorFlash;

use super::authority::Authority;
use super::layout::{MAX_WRITE, Slot};
use super::readback::{Found, Readback};
use super::record::Record;
use super::store::{Candidate, Slots};
use crate::update::{Plan, Update};

/// Writes images from the link into the slot that is not running.
///
/// Requests only start long work; [`Self::work`] does it piece by piece.
pub struct Updater<F, A: Authority> {
    slots: Slots<F, A>,
    /// Slot of the running image; `None` if it is built in.
    running: Option<Slot>,
    phase: Phase<A::Hash>,
}

enum Phase<H> {
    /// No update is in progress.
    Idle,
    /// Sectors from `next` on will be erased.
    Erasing { plan: Plan, slot: Slot, next: u32 },
    /// Waiting for bytes.
    Receiving { plan: Plan, slot: Slot, tail: Tail },
    /// All bytes are written and are being read back.
    Checking { plan: Plan, slot: Slot, signature: Option<[u8; 64]>, readback: Readback<H> },
    /// The image waits for its test.
    Testing { plan: Plan, slot: Slot },
    /// The update ended, with or without success; `is_told` after an acknowledgement of the outcome.
    Done { plan: Plan, outcome: Result<(), Refusal>, is_told: bool },
}

/// Accepted bytes; the last of them wait until a unit of writing is full.
#[derive(Clone, Copy)]
struct Tail {
    taken: u32,
    unit: [u8; MAX_WRITE],
}

/// Work that remains after [`Updater::work`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Work {
    /// No work until the next request.
    Idle,
    /// More work: call it again.
    More,
    /// Run the self-test of this image, which replaces the running one, and pass its outcome to [`Updater::tested`].
    Test(Candidate),
}

impl<F: NorFlash, A: Authority> Updater<F, A> {
    /// Creates an updater for slots with the running slot, if any.
    pub const fn new(slots: Slots<F, A>, running: Option<Slot>) -> Self {
        Self { slots, running, phase: Phase::Idle }
    }

    /// Returns the slots.
    pub const fn slots(&mut self) -> &mut Slots<F, A> {
        &mut self.slots
    }

    /// Returns the slot of the running image.
    pub const fn running(&self) -> Option<Slot> {
        self.running
    }

    /// Returns `true` if the next [`Self::work`] takes long: it erases a sector, checks a signature, or requests a
    /// test.
    pub const fn takes_long(&self) -> bool {
        match &self.phase {
            Phase::Erasing { .. } | Phase::Testing { .. } => true,
            Phase::Checking { plan, readback, .. } => readback.is_last(plan),
            _ => false,
        }
    }

    /// Erases one sector or reads one block.
    pub fn work(&mut self) -> Work {
        match core::mem::replace(&mut self.phase, Phase::Idle) {
            Phase::Erasing { plan, slot, next } => self.erase(plan, slot, next),
            Phase::Checking { plan, slot, signature, readback } => self.check(plan, slot, signature, readback),
            phase => {
                self.phase = phase;
                self.test()
            }
        }
    }

    fn erase(&mut self, plan: Plan, slot: Slot, next: u32) -> Work {
        let sector = next.saturating_add(F::ERASE_SIZE as u32);
        self.phase = match self.slots.flash.erase(next, sector) {
            Err(_) => Phase::Done { plan, outcome: Err(Refusal::Flash), is_told: false },
            Ok(()) if sector < self.slots.layout.range(slot).end => Phase::Erasing { plan, slot, next: sector },
            Ok(()) => Phase::Receiving { plan, slot, tail: Tail { taken: 0, unit: [0xff; MAX_WRITE] } },
        };
        Work::More
    }

    fn check(&mut self, plan: Plan, slot: Slot, signature: Option<[u8; 64]>, readback: Readback<A::Hash>) -> Work {
        let Slots { flash, layout, authority, .. } = &mut self.slots;
        let found = match readback.advance(flash, layout.image(slot), &plan, signature.as_ref(), authority) {
            Ok(readback) => {
                self.phase = Phase::Checking { plan, slot, signature, readback };
                return Work::More;
            }
            Err(found) => found,
        };
        let refused = match found {
            Found::Good => {
                let generation = self.slots.next_generation();
                let record = Record { plan, generation, signature, build: self.slots.build };
                let written = self.slots.write_record(slot, record) && self.slots.begin_trial(slot);
                if !written {
                    // The record may be complete all the same, and the next start would try it.
                    self.slots.reject(slot);
                }
                (!written).then_some(Refusal::Flash)
            }
            Found::Damaged => Some(Refusal::Checksum),
            Found::Unsigned => Some(Refusal::Signature),
        };
        self.phase = match refused {
            Some(refusal) => Phase::Done { plan, outcome: Err(refusal), is_told: false },
            None => Phase::Testing { plan, slot },
        };
        Work::More
    }

    fn test(&self) -> Work {
        let Phase::Testing { plan, slot } = &self.phase else { return Work::Idle };
        let (slot, address) = (*slot, self.slots.layout.image(*slot));
        let Plan { length, crc, version } = *plan;
        Work::Test(Candidate { slot, address, length, crc, version, trial: true })
    }

    /// Takes the outcome of the test. Returns `true` if the image is confirmed and runs; else the previous one must
    /// continue.
    pub fn tested(&mut self, outcome: Result<(), Refusal>) -> bool {
        let Phase::Testing { plan, slot } = self.phase else { return false };
        let outcome = match outcome {
            Ok(()) if self.slots.confirm(slot) => {
                self.running = Some(slot);
                Ok(())
            }
            failed => {
                self.slots.reject(slot);
                Err(failed.err().unwrap_or(Refusal::Flash))
            }
        };
        self.phase = Phase::Done { plan, outcome, is_told: false };
        outcome.is_ok()
    }

    /// Appends bytes; returns `false` if writing to flash fails.
    fn append(&mut self, slot: Slot, tail: &mut Tail, bytes: &[u8], length: u32) -> bool {
        let image = self.slots.layout.image(slot);
        for byte in bytes {
            let unit = F::WRITE_SIZE as u32;
            let at = tail.taken % unit;
            if let Some(place) = tail.unit.get_mut(at as usize) {
                *place = *byte;
            }
            tail.taken += 1;
            if at + 1 == unit || tail.taken == length {
                let full = tail.unit.get(..F::WRITE_SIZE).unwrap_or_default();
                if self.slots.flash.write(image + (tail.taken - at - 1), full).is_err() {
                    return false;
                }
                tail.unit = [0xff; MAX_WRITE];
            }
        }
        true
    }
}

impl<F: NorFlash, A: Authority> Update for Updater<F, A> {
    fn begin(&mut self, plan: Plan) -> Result<(), Refusal> {
        match &self.phase {
            Phase::Erasing { plan: old, .. } if *old == plan => return Err(Refusal::Busy),
            Phase::Receiving { plan: old, tail, .. } if *old == plan && tail.taken == 0 => return Ok(()),
            // The erase that an earlier repetition of this request began.
            Phase::Done { plan: old, outcome: Err(Refusal::Flash), is_told: false } if *old == plan => {
                self.phase = Phase::Idle;
                return Err(Refusal::Flash);
            }
            Phase::Checking { .. } | Phase::Testing { .. } => return Err(Refusal::Busy),
            _ => {}
        }
        let slot = self.slots.spare(self.running);
        if plan.length == 0 || !plan.length.is_multiple_of(4) || plan.length > self.slots.layout.room(slot) {
            return Err(Refusal::Length);
        }
        if plan.version < self.slots.least_version() {
            return Err(Refusal::Rollback);
        }
        self.phase = Phase::Erasing { plan, slot, next: self.slots.layout.range(slot).start };
        Err(Refusal::Busy)
    }

    fn chunk(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Refusal> {
        let Phase::Receiving { plan, slot, mut tail } = self.phase else {
            return Err(if self.is_busy() { Refusal::Busy } else { Refusal::NoUpdate });
        };
        let end = u32::try_from(bytes.len()).ok().and_then(|len| offset.checked_add(len)).ok_or(Refusal::Length)?;
        if end > plan.length {
            return Err(Refusal::Length);
        }
        if end <= tail.taken {
            return Ok(());
        }
        if offset != tail.taken {
            return Err(Refusal::Offset);
        }
        if !self.append(slot, &mut tail, bytes, plan.length) {
            self.phase = Phase::Done { plan, outcome: Err(Refusal::Flash), is_told: true };
            return Err(Refusal::Flash);
        }
        self.phase = Phase::Receiving { plan, slot, tail };
        Ok(())
    }

    fn commit(&mut self, signature: Option<&[u8; 64]>) -> Result<(), Refusal> {
        match self.phase {
            Phase::Idle => Err(Refusal::NoUpdate),
            Phase::Done { plan, outcome, .. } => {
                self.phase = Phase::Done { plan, outcome, is_told: true };
                outcome
            }
            Phase::Receiving { plan, slot, tail } if tail.taken == plan.length => {
                let readback = Readback::new(&self.slots.authority);
                self.phase = Phase::Checking { plan, slot, signature: signature.copied(), readback };
                Err(Refusal::Busy)
            }
            Phase::Receiving { .. } => Err(Refusal::Length),
            Phase::Erasing { .. } | Phase::Checking { .. } | Phase::Testing { .. } => Err(Refusal::Busy),
        }
    }

    fn abort(&mut self) -> Result<(), Refusal> {
        if let Phase::Testing { .. } = self.phase {
            return Err(Refusal::Busy);
        }
        self.phase = Phase::Idle;
        Ok(())
    }

    fn written(&self) -> u32 {
        match &self.phase {
            Phase::Idle | Phase::Erasing { .. } => 0,
            Phase::Receiving { tail, .. } => tail.taken,
            Phase::Checking { plan, .. } | Phase::Testing { plan, .. } | Phase::Done { plan, .. } => plan.length,
        }
    }

    fn is_busy(&self) -> bool {
        matches!(self.phase, Phase::Erasing { .. } | Phase::Checking { .. } | Phase::Testing { .. })
    }
}
