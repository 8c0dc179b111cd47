//! NOR flash with its rules: an erase gives ones, a write clears bits, and a unit is written once after an erase.

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};

use crate::power::{Change, Power};
use crate::random::Random;

/// Flash written in units of `UNIT` bytes and erased in sectors of `SECTOR` bytes. A request that breaks a rule panics.
#[derive(Clone, Debug)]
pub struct Nor<const UNIT: usize, const SECTOR: usize> {
    /// The content.
    pub bytes: Vec<u8>,
    /// Units written since their last erase.
    written: Vec<bool>,
    /// Its power: each unit written and each sector erased is a change.
    pub power: Power,
}

/// The power of the flash has failed.
#[derive(Clone, Copy, Debug)]
pub struct NoPower;

impl NorFlashError for NoPower {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl<const UNIT: usize, const SECTOR: usize> Nor<UNIT, SECTOR> {
    /// Creates a flash full of random bytes.
    pub fn new(sectors: usize, seed: u64) -> Self {
        let mut random = Random::new(seed);
        let bytes = random.bytes(sectors * SECTOR);
        Self { bytes, written: vec![true; sectors * SECTOR / UNIT], power: Power::new(random) }
    }
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
            let change = self.power.change();
            let (bytes, units) = (start..start + SECTOR, start / UNIT..(start + SECTOR) / UNIT);
            match change {
                Change::Whole => self.bytes[bytes].fill(0xff),
                Change::Part => {
                    let erased = self.power.erased();
                    self.bytes[bytes].iter_mut().zip(erased).for_each(|(byte, ones)| *byte |= ones);
                }
                Change::Nothing => return Err(NoPower),
            }
            self.written[units].fill(change == Change::Part);
            if change == Change::Part {
                return Err(NoPower);
            }
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NoPower> {
        let offset = offset as usize;
        assert!(offset.is_multiple_of(UNIT) && bytes.len().is_multiple_of(UNIT), "not whole units");
        for (i, unit) in bytes.chunks(UNIT).enumerate() {
            let start = offset + i * UNIT;
            let change = self.power.change();
            if change == Change::Nothing {
                return Err(NoPower);
            }
            assert!(!self.written[start / UNIT], "the unit at {start} is written twice");
            self.written[start / UNIT] = true;
            for (at, byte) in unit.iter().enumerate() {
                let kept = if change == Change::Part { self.power.kept() } else { 0 };
                self.bytes[start + at] &= byte | kept;
            }
            if change == Change::Part {
                return Err(NoPower);
            }
        }
        Ok(())
    }
}
