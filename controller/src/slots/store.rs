//! The slots' records and marks: which image runs.

use embedded_storage::nor_flash::NorFlash;

use super::authority::Authority;
use super::layout::{HEADER, Layout, Slot};
use super::marks::{Mark, Marks};
use super::readback::{Found, Readback};
use super::record::{BYTES, Record};

/// Trials of an image that is not confirmed, before it is taken for one that ends the program. A loss of power ends
/// one, too.
pub const TRIALS: u32 = 3;

/// Two slots in a flash.
pub struct Slots<F, A> {
    pub(super) flash: F,
    pub(super) layout: Layout,
    pub(super) authority: A,
    /// Slots that are not to be chosen again before the next start.
    refused: [bool; 2],
}

/// An image to run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Candidate {
    /// Where it is.
    pub slot: Slot,
    /// Address of its first byte in the flash.
    pub address: u32,
    /// Its bytes.
    pub length: u32,
    /// CRC-32 (ISO-HDLC) of all of them.
    pub crc: u32,
    /// Its version.
    pub version: u32,
    /// Whether it has yet to be confirmed.
    pub trial: bool,
}

impl<F: NorFlash, A: Authority> Slots<F, A> {
    /// Slots in `flash`, with images of `authority`.
    pub const fn new(flash: F, layout: Layout, authority: A) -> Self {
        Self { flash, layout, authority, refused: [false; 2] }
    }

    /// The flash, to read an image where it is not mapped into memory.
    pub const fn flash(&mut self) -> &mut F {
        &mut self.flash
    }

    /// The image to run: whole, signed as it must be, not rejected, the newest such. To be tested then, and
    /// [confirmed](Self::confirm) or [rejected](Self::reject), after which this gives another one or none. Reads one
    /// image or both, and tells `progress` before each block of them, and so before the check of a signature, which
    /// comes with the last one.
    pub fn select(&mut self, mut progress: impl FnMut()) -> Option<Candidate> {
        let generation = |record: Option<Record>| record.map(|record| record.generation);
        let newest = match generation(self.record(Slot::B)) > generation(self.record(Slot::A)) {
            true => Slot::B,
            false => Slot::A,
        };
        self.candidate(newest, &mut progress).or_else(|| self.candidate(newest.other(), &mut progress))
    }

    fn candidate(&mut self, slot: Slot, progress: impl FnMut()) -> Option<Candidate> {
        let (record, marks) = (self.record(slot)?, self.marks(slot)?);
        if self.is_refused(slot) || marks.rejected || self.read_back(slot, &record, progress) != Found::Good {
            return None;
        }
        let may_run = marks.confirmed || marks.trials < TRIALS && marks.write(&mut self.flash, Mark::Trial);
        if !may_run {
            return None;
        }
        let (length, crc, version) = (record.plan.length, record.plan.crc, record.plan.version);
        Some(Candidate { slot, address: self.layout.image(slot), length, crc, version, trial: !marks.confirmed })
    }

    /// The image in a slot has passed its test; false where that cannot be written.
    #[must_use]
    pub fn confirm(&mut self, slot: Slot) -> bool {
        let Some(marks) = self.marks(slot) else { return false };
        marks.confirmed || marks.write(&mut self.flash, Mark::Confirmed)
    }

    /// The image in a slot has failed its test. One that has never passed it is not tried again; one that has, not
    /// before the next start.
    pub fn reject(&mut self, slot: Slot) {
        if let Some(refused) = self.refused.get_mut(slot as usize) {
            *refused = true;
        }
        if let Some(marks) = self.marks(slot)
            && !marks.confirmed
        {
            // Where it cannot be written, it is tried again after the next start.
            let _ = marks.write(&mut self.flash, Mark::Rejected);
        }
    }

    /// The least version that an update may have: the highest that was confirmed.
    pub fn least_version(&mut self) -> u32 {
        let versions = Slot::BOTH.map(|slot| {
            let confirmed = self.marks(slot).is_some_and(|marks| marks.confirmed);
            self.record(slot).filter(|_| confirmed).map_or(0, |record| record.plan.version)
        });
        versions.into_iter().fold(0, u32::max)
    }

    /// The generation of the next image.
    pub(super) fn next_generation(&mut self) -> u32 {
        let generations = Slot::BOTH.map(|slot| self.record(slot).map_or(0, |record| record.generation));
        generations.into_iter().fold(0, u32::max).saturating_add(1)
    }

    /// The slot that an update may erase while `running` runs; without that, the older one.
    pub(super) fn spare(&mut self, running: Option<Slot>) -> Slot {
        let generation = |record: Option<Record>| record.map(|record| record.generation);
        match running {
            Some(slot) => slot.other(),
            None if generation(self.record(Slot::A)) > generation(self.record(Slot::B)) => Slot::B,
            None => Slot::A,
        }
    }

    /// Writes a record into a slot that holds the image already, and lets it be chosen.
    pub(super) fn write_record(&mut self, slot: Slot, record: Record) -> bool {
        if let Some(refused) = self.refused.get_mut(slot as usize) {
            *refused = false;
        }
        self.flash.write(self.layout.range(slot).start, &record.to_bytes()).is_ok()
    }

    /// Marks that a trial begins, outside of [`Self::select`].
    pub(super) fn begin_trial(&mut self, slot: Slot) -> bool {
        self.marks(slot).is_some_and(|marks| marks.write(&mut self.flash, Mark::Trial))
    }

    fn is_refused(&self, slot: Slot) -> bool {
        self.refused.get(slot as usize).copied().unwrap_or(true)
    }

    fn record(&mut self, slot: Slot) -> Option<Record> {
        let mut bytes = [0; BYTES];
        self.flash.read(self.layout.range(slot).start, &mut bytes).ok()?;
        Record::from_bytes(&bytes).filter(|record| record.plan.length <= self.layout.room(slot))
    }

    fn marks(&mut self, slot: Slot) -> Option<Marks> {
        Marks::read(&mut self.flash, self.layout.range(slot).start + HEADER / 2)
    }

    fn read_back(&mut self, slot: Slot, record: &Record, mut progress: impl FnMut()) -> Found {
        let mut readback = Readback::new(&self.authority);
        loop {
            progress();
            let (image, signature) = (self.layout.image(slot), record.signature.as_ref());
            match readback.advance(&mut self.flash, image, &record.plan, signature, &self.authority) {
                Ok(on) => readback = on,
                Err(found) => return found,
            }
        }
    }
}
