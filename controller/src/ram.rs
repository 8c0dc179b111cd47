//! RAM with the rules of NOR flash, for emulators without a flash controller, and for tests.

use core::cell::Cell;
use core::ops::Range;

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};

/// Memory that is erased to ones in sectors of `SECTOR` bytes, and of which a unit of `UNIT` bytes is programmed once. Cells, because an
/// image runs in place from one part of a flash while another part is written.
#[derive(Debug)]
pub struct Ram<'m, const UNIT: usize, const SECTOR: usize>(pub &'m [Cell<u8>]);

/// Why a request was not done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RamError {
    /// It is not within the memory.
    Bounds,
    /// It does not begin or end between two units or sectors.
    Alignment,
    /// A unit was programmed since it was erased.
    Programmed,
}

impl NorFlashError for RamError {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Bounds => NorFlashErrorKind::OutOfBounds,
            Self::Alignment => NorFlashErrorKind::NotAligned,
            Self::Programmed => NorFlashErrorKind::Other,
        }
    }
}

impl<'m, const UNIT: usize, const SECTOR: usize> Ram<'m, UNIT, SECTOR> {
    /// All of `memory`.
    pub fn new(memory: &'m mut [u8]) -> Self {
        Self(Cell::from_mut(memory).as_slice_of_cells())
    }

    fn part(&self, from: u32, len: usize, unit: usize) -> Result<&'m [Cell<u8>], RamError> {
        let from = usize::try_from(from).map_err(|_| RamError::Bounds)?;
        if !from.is_multiple_of(unit) || !len.is_multiple_of(unit) {
            return Err(RamError::Alignment);
        }
        let range: Range<usize> = from..from.checked_add(len).ok_or(RamError::Bounds)?;
        self.0.get(range).ok_or(RamError::Bounds)
    }
}

impl<const UNIT: usize, const SECTOR: usize> ErrorType for Ram<'_, UNIT, SECTOR> {
    type Error = RamError;
}

impl<const UNIT: usize, const SECTOR: usize> ReadNorFlash for Ram<'_, UNIT, SECTOR> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), RamError> {
        let part = self.part(offset, bytes.len(), 1)?;
        bytes.iter_mut().zip(part).for_each(|(place, byte)| *place = byte.get());
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.0.len()
    }
}

impl<const UNIT: usize, const SECTOR: usize> NorFlash for Ram<'_, UNIT, SECTOR> {
    const WRITE_SIZE: usize = UNIT;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), RamError> {
        let len = to.checked_sub(from).and_then(|len| usize::try_from(len).ok()).ok_or(RamError::Bounds)?;
        self.part(from, len, SECTOR)?.iter().for_each(|byte| byte.set(0xff));
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), RamError> {
        let part = self.part(offset, bytes.len(), UNIT)?;
        if part.iter().any(|byte| byte.get() != 0xff) {
            return Err(RamError::Programmed);
        }
        part.iter().zip(bytes).for_each(|(place, byte)| place.set(*byte));
        Ok(())
    }
}
