//! The slots' records and marks, which select the image to run.

use embedded_storage::nor_flash::NorFlash;

use super::authority::Authority;
use super::layout::{HEADER, Layout, Slot};
use super::marks::{Mark, Marks};
use super::readback::{Found, Readback};
use super::record::{BYTES, Record};

/// Trials of an unconfirmed image before it counts as one that crashes the program. A loss of power also ends a trial.
pub const TRIALS: u32 = 3;

/// Two image slots in a flash.
pub struct Slots<F, A> {
    pub(super) flash: F,
    pub(super) layout: Layout,
    pub(super) authority: A,
    /// Build of the firmware ([`Self::new`]).
    pub(super) build: u32,
    /// Slots that must not be selected again before the next start.
    refused: [bool; 2],
    /// Highest confirmed version that the slots had since the start: an update erases a record before it has another.
    floor: u32,
}

/// An image to run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Candidate {
    /// Slot of the image.
    pub slot: Slot,
    /// Address of its first byte in the flash.
    pub address: u32,
    /// Length in bytes.
    pub length: u32,
    /// CRC-32 (ISO-HDLC) of all bytes.
    pub crc: u32,
    /// Version of the image.
    pub version: u32,
    /// `true` if the image is not confirmed yet.
    pub trial: bool,
}

impl<F: NorFlash, A: Authority> Slots<F, A> {
    /// Creates slots in `flash` for images that `authority` accepts. `build` identifies what the firmware took from its
    /// built-in image, as limits and the order of axes: that image's CRC-32. An image that arrived under another build
    /// does not run, because its actions would have another meaning. Its version still counts.
    pub const fn new(flash: F, layout: Layout, authority: A, build: u32) -> Self {
        Self { flash, layout, authority, build, refused: [false; 2], floor: 0 }
    }

    /// Returns the flash, to read an image that is not mapped into memory.
    pub const fn flash(&mut self) -> &mut F {
        &mut self.flash
    }

    /// Selects the image to run: the newest one of this build that is complete, accepted by the authority and not
    /// rejected. The caller tests it and [confirms](Self::confirm) or [rejects](Self::reject) it. After a rejection
    /// this selects another one or none. It reads one image or both, and calls `progress` before each block. The check
    /// of a signature follows the last block without another call.
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
        let may_not = self.is_refused(slot) || marks.rejected || record.build != self.build;
        if may_not || self.read_back(slot, &record, progress) != Found::Good {
            return None;
        }
        let may_run = marks.confirmed || marks.trials < TRIALS && marks.write(&mut self.flash, Mark::Trial);
        if !may_run {
            return None;
        }
        let (length, crc, version) = (record.plan.length, record.plan.crc, record.plan.version);
        Some(Candidate { slot, address: self.layout.image(slot), length, crc, version, trial: !marks.confirmed })
    }

    /// Records that the image in a slot passed its test; returns `false` if writing fails.
    #[must_use]
    pub fn confirm(&mut self, slot: Slot) -> bool {
        let Some(marks) = self.marks(slot) else { return false };
        marks.confirmed || marks.write(&mut self.flash, Mark::Confirmed)
    }

    /// Records that the image in a slot failed its test. An image that never passed is not tried again; one that passed
    /// before is not tried again until the next start.
    pub fn reject(&mut self, slot: Slot) {
        if let Some(refused) = self.refused.get_mut(slot as usize) {
            *refused = true;
        }
        if let Some(marks) = self.marks(slot)
            && !marks.confirmed
        {
            // If writing fails, the image is tried again after the next start.
            let _ = marks.write(&mut self.flash, Mark::Rejected);
        }
    }

    /// Returns the lowest version that an update may have: the highest one that was confirmed in a slot in this or an
    /// earlier call since the start.
    pub fn least_version(&mut self) -> u32 {
        let versions = Slot::BOTH.map(|slot| {
            let confirmed = self.marks(slot).is_some_and(|marks| marks.confirmed);
            self.record(slot).filter(|_| confirmed).map_or(0, |record| record.plan.version)
        });
        self.floor = versions.into_iter().fold(self.floor, u32::max);
        self.floor
    }

    /// Returns the generation of the next image.
    pub(super) fn next_generation(&mut self) -> u32 {
        let generations = Slot::BOTH.map(|slot| self.record(slot).map_or(0, |record| record.generation));
        generations.into_iter().fold(0, u32::max).saturating_add(1)
    }

    /// Returns the slot that an update may erase while `running` runs; without a running slot, the older one.
    pub(super) fn spare(&mut self, running: Option<Slot>) -> Slot {
        let generation = |record: Option<Record>| record.map(|record| record.generation);
        match running {
            Some(slot) => slot.other(),
            None if generation(self.record(Slot::A)) > generation(self.record(Slot::B)) => Slot::B,
            None => Slot::A,
        }
    }

    /// Writes a record into a slot that already holds the image, and allows its selection.
    pub(super) fn write_record(&mut self, slot: Slot, record: Record) -> bool {
        if let Some(refused) = self.refused.get_mut(slot as usize) {
            *refused = false;
        }
        self.flash.write(self.layout.range(slot).start, &record.to_bytes()).is_ok()
    }

    /// Marks the beginning of a trial outside of [`Self::select`].
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
