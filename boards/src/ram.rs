//! RAM with the rules of NOR flash, for emulators without a flash controller and for tests.

use core::cell::Cell;
use core::ops::Range;

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};

/// Memory that is erased to ones in sectors of `SECTOR` bytes and programmed once in units of `UNIT` bytes. It consists
/// of cells, because an image runs in place from one part of a flash while another part is written.
#[derive(Debug)]
pub struct Ram<'m, const UNIT: usize, const SECTOR: usize>(pub &'m [Cell<u8>]);

/// Reason for refusing a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RamError {
    /// The request is not within the memory.
    Bounds,
    /// The request does not begin and end at a unit or sector boundary.
    Alignment,
    /// A unit was programmed since its last erase.
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
    /// Uses all of `memory`.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ram_follows_the_rules_of_flash() {
        let mut memory = [7; 64];
        let mut ram = Ram::<4, 16>::new(&mut memory);
        assert_eq!(ram.write(0, &[1; 4]), Err(RamError::Programmed), "not erased");
        assert_eq!(ram.erase(0, 32), Ok(()));
        assert_eq!(ram.write(4, &[1; 8]), Ok(()));
        assert_eq!(ram.write(8, &[1; 4]), Err(RamError::Programmed));
        assert_eq!([ram.erase(4, 16), ram.erase(0, 8), ram.write(2, &[0; 4])], [Err(RamError::Alignment); 3]);
        assert_eq!([ram.erase(32, 16), ram.erase(48, 80), ram.write(64, &[0; 4])], [Err(RamError::Bounds); 3]);
        let mut bytes = [0; 16];
        assert_eq!(ram.read(3, &mut bytes), Ok(()));
        assert_eq!(bytes, [255, 1, 1, 1, 1, 1, 1, 1, 1, 255, 255, 255, 255, 255, 255, 255]);
        assert_eq!(ram.read(50, &mut bytes), Err(RamError::Bounds));
    }
}
