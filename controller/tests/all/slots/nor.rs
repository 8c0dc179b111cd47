//! A model of NOR flash: erasing sets ones, programming clears ones, and a unit is programmed once after an erase.
//! Power may fail during any change.

use actq_boards::stm32f405::flash::model::Model;
use actq_boards::stm32f405::flash::{Flash, LARGE};
use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};

use crate::random::Random;

/// Flash written in units of `UNIT` bytes and erased in sectors of `SECTOR`.
#[derive(Clone)]
pub(super) struct Nor<const UNIT: usize, const SECTOR: usize> {
    pub(super) bytes: Vec<u8>,
    /// Units programmed since their last erase.
    programmed: Vec<bool>,
    /// Units programmed and sectors erased so far.
    pub(super) done: usize,
    /// Number of the change during which power fails, if it does.
    pub(super) fails_at: Option<usize>,
    pub(super) random: Random,
}

/// Power has failed, or the request violates a rule.
#[derive(Clone, Copy, Debug)]
pub(super) struct NoPower;

impl NorFlashError for NoPower {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

/// Flash whose power fails, with a test's number of sectors.
pub(super) trait Fails: NorFlash + Clone {
    /// Creates flash with arbitrary content, as after another use.
    fn new(sectors: usize, seed: u64) -> Self;

    /// Returns all bytes.
    fn bytes(&self) -> Vec<u8>;

    /// Returns the number of changes so far.
    fn done(&self) -> usize;

    /// Restores power; it fails again during the change after `fails_at` others, if given.
    fn restart(&mut self, fails_at: Option<usize>);
}

impl<const UNIT: usize, const SECTOR: usize> Fails for Nor<UNIT, SECTOR> {
    fn new(sectors: usize, seed: u64) -> Self {
        Self::new(sectors, seed)
    }

    fn bytes(&self) -> Vec<u8> {
        self.bytes.clone()
    }

    fn done(&self) -> usize {
        self.done
    }

    fn restart(&mut self, fails_at: Option<usize>) {
        (self.done, self.fails_at) = (0, fails_at);
    }
}

/// The upper sectors of an STM32F405 with its driver: power fails during a write to a register or to memory.
impl Fails for Flash<Model> {
    fn new(sectors: usize, seed: u64) -> Self {
        let begin = (1 << 20) - sectors as u32 * LARGE;
        let mut random = Random::new(seed);
        let memory = (0..sectors * LARGE as usize).map(|_| random.bits() as u8).collect();
        Self::new(Model::new(memory, begin, seed), begin)
    }

    fn bytes(&self) -> Vec<u8> {
        self.part.bytes()
    }

    fn done(&self) -> usize {
        self.part.done
    }

    fn restart(&mut self, fails_at: Option<usize>) {
        self.part = self.part.clone().restarted();
        self.part.fails_at = fails_at;
    }
}

impl<const UNIT: usize, const SECTOR: usize> Nor<UNIT, SECTOR> {
    /// Creates flash with arbitrary content, as after another use.
    pub(super) fn new(sectors: usize, seed: u64) -> Self {
        let mut random = Random::new(seed);
        let bytes = (0..sectors * SECTOR).map(|_| random.bits() as u8).collect();
        Self { bytes, programmed: vec![true; sectors * SECTOR / UNIT], done: 0, fails_at: None, random }
    }

    /// Returns the outcome of the next change: whole, partial, or none.
    fn next(&mut self) -> Outcome {
        let outcome = match self.fails_at {
            Some(at) if self.done == at => Outcome::Part,
            Some(at) if self.done > at => return Outcome::Nothing,
            _ => Outcome::Whole,
        };
        self.done += 1;
        outcome
    }
}

enum Outcome {
    Whole,
    Part,
    Nothing,
}

impl<const UNIT: usize, const SECTOR: usize> ErrorType for Nor<UNIT, SECTOR> {
    type Error = NoPower;
}

impl<const UNIT: usize, const SECTOR: usize> ReadNorFlash for Nor<UNIT, SECTOR> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NoPower> {
        let offset = offset as usize;
        bytes.copy_from_slice(&self.bytes[offset..offset + bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl<const UNIT: usize, const SECTOR: usize> NorFlash for Nor<UNIT, SECTOR> {
    const WRITE_SIZE: usize = UNIT;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NoPower> {
        let (from, to) = (from as usize, to as usize);
        assert!(from.is_multiple_of(SECTOR) && to.is_multiple_of(SECTOR) && from < to && to <= self.bytes.len());
        for start in (from..to).step_by(SECTOR) {
            match self.next() {
                Outcome::Whole => {
                    self.bytes[start..start + SECTOR].fill(0xff);
                    self.programmed[start / UNIT..(start + SECTOR) / UNIT].fill(false);
                }
                Outcome::Part => {
                    // Some bits are ones already: few, about half, or almost all, depending on the moment.
                    let moment = self.random.below(3);
                    for at in start..start + SECTOR {
                        let (a, b) = (self.random.bits() as u8, self.random.bits() as u8);
                        self.bytes[at] |= [a & b & (self.random.bits() as u8), a, a | b][moment];
                    }
                    self.programmed[start / UNIT..(start + SECTOR) / UNIT].fill(true);
                    return Err(NoPower);
                }
                Outcome::Nothing => return Err(NoPower),
            }
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NoPower> {
        let offset = offset as usize;
        assert!(offset.is_multiple_of(UNIT) && bytes.len().is_multiple_of(UNIT), "not whole units");
        for (i, unit) in bytes.chunks(UNIT).enumerate() {
            let start = offset + i * UNIT;
            let outcome = self.next();
            if let Outcome::Nothing = outcome {
                return Err(NoPower);
            }
            assert!(!self.programmed[start / UNIT], "the unit at {start} is programmed twice");
            self.programmed[start / UNIT] = true;
            for (at, byte) in unit.iter().enumerate() {
                let kept = if let Outcome::Part = outcome { self.random.bits() as u8 } else { 0 };
                self.bytes[start + at] &= byte | kept;
            }
            if let Outcome::Part = outcome {
                return Err(NoPower);
            }
        }
        Ok(())
    }
}
