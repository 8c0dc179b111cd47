//! Erasing and programming the flash of an STM32F405 (RM0090, section 3.6): the controller's sequences, their
//! preconditions, and its errors by name. [`Part`] abstracts the registers, so that all of it also runs on the host, on
//! a model (the feature `model`).
//!
//! The part has one bank. An erase takes up to 2 s, and programming a word up to 0.1 ms. During it any fetch or read
//! from flash stalls the processor, including its interrupts. So no request starts unless the power stage's register
//! says that it is off. An erase sets the watchdog's timeout to the data sheet's longest erase time. Afterwards the
//! watchdog is fed only if the erase took no longer. If the controller does not finish, the watchdog resets the part.

#[cfg(any(test, feature = "model"))]
pub mod model;

use core::cell::Cell;
use core::fmt;
use core::ops::Range;

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};

/// Number of sectors: 4 of 16 KB, one of 64 KB, 7 of 128 KB (section 3.4).
pub const SECTORS: u32 = 12;
/// Bytes of a sector from the sixth on. Image slots consist of these.
pub const LARGE: u32 = 128 << 10;

/// Returns the addresses of a sector, relative to the flash's first byte.
pub const fn sector(number: u32) -> Range<u32> {
    const SMALL: u32 = 16 << 10;
    match number {
        0..=3 => number * SMALL..(number + 1) * SMALL,
        4 => 4 * SMALL..LARGE,
        _ => (number - 4) * LARGE..(number - 3) * LARGE,
    }
}

/// Returns the longest erase time of a sector in milliseconds (data sheet DS8626, flash characteristics, x32).
pub const fn longest_erase(number: u32) -> u16 {
    match number {
        0..=3 => 500,
        4 => 1100,
        _ => 2000,
    }
}

/// A register of the flash controller (section 3.9).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Register {
    /// FLASH_ACR: caches.
    Access,
    /// FLASH_KEYR.
    Key,
    /// FLASH_SR.
    Status,
    /// FLASH_CR.
    Control,
}

/// Keys that unlock FLASH_CR, in order.
const KEYS: [u32; 2] = [0x4567_0123, 0xcdef_89ab];
// FLASH_SR: writing a flag clears it.
const WRPERR: u32 = 1 << 4;
const PGAERR: u32 = 1 << 5;
const PGPERR: u32 = 1 << 6;
const PGSERR: u32 = 1 << 7;
const BSY: u32 = 1 << 16;
// FLASH_CR.
const PG: u32 = 1 << 0;
const SER: u32 = 1 << 1;
const SNB: u32 = 3;
/// PSIZE for words, which need 2.7 V (section 3.6.2).
const WORDS: u32 = 0b10 << 8;
const STRT: u32 = 1 << 16;
const LOCK: u32 = 1 << 31;
// FLASH_ACR.
const ICEN: u32 = 1 << 9;
const DCEN: u32 = 1 << 10;
const ICRST: u32 = 1 << 11;
const DCRST: u32 = 1 << 12;

/// Largest number of reads of BSY for a word, and for a sector. A read takes at least 4 cycles, so these are above 0.1
/// ms and 2 s at 168 MHz.
const PROGRAM_READS: u32 = 17_000;
const ERASE_READS: u32 = 84_000_000;

/// The part's interface for these sequences.
pub trait Part {
    /// Reads a register.
    fn read(&self, register: Register) -> u32;

    /// Writes a register.
    fn write(&mut self, register: Register, value: u32);

    /// Returns the writable memory.
    fn memory(&self) -> &[Cell<u8>];

    /// Writes a word to the memory in one access, at an offset that is a multiple of 4.
    fn program(&mut self, at: u32, word: u32);

    /// Returns `true` if the power stage is on.
    fn is_driving(&self) -> bool;

    /// Returns `true` if the supply has the voltage for programming words.
    fn is_supplied(&self) -> bool;

    /// Does `work` with a watchdog timeout of `milliseconds`, then restores the usual timeout. Returns `None`, with
    /// nothing done, if the watchdog does not accept the timeout. If the work took longer, nothing feeds the watchdog
    /// any more, and it resets the board.
    fn with_watchdog_timeout<R>(&mut self, milliseconds: u16, work: impl FnOnce(&mut Self) -> R) -> Option<R>;
}

/// Reason why a request failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FlashError {
    /// The request is not within the memory.
    Bounds,
    /// The request does not begin and end at a word or sector boundary.
    Alignment,
    /// The memory to program is not erased.
    Programmed,
    /// The power stage is on.
    Driving,
    /// The supply is below the voltage that programming needs.
    Supply,
    /// The watchdog does not accept another timeout.
    Watchdog,
    /// The controller does not unlock.
    Locked,
    /// The controller does not accept its settings, or does not exist.
    Settings,
    /// The controller does not finish.
    Busy,
    /// WRPERR.
    WriteProtected,
    /// PGAERR.
    Row,
    /// PGPERR.
    Parallelism,
    /// PGSERR.
    Sequence,
    /// The memory differs from what was erased or programmed.
    Differs,
}

impl fmt::Display for FlashError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Bounds => "the request is not within the writable flash",
            Self::Alignment => "the request does not begin and end at a word or sector boundary",
            Self::Programmed => "the flash to program is not erased",
            Self::Driving => "the power stage is on; disarm first",
            Self::Supply => "the supply is below 2.9 V",
            Self::Watchdog => "the watchdog does not accept another timeout",
            Self::Locked => "the flash controller does not unlock (LOCK); reset the board",
            Self::Settings => "the flash controller does not accept its settings; check that the part has one",
            Self::Busy => "the flash controller does not finish (BSY)",
            Self::WriteProtected => "the sector is write-protected by the option bytes (WRPERR)",
            Self::Row => "a write crosses a row of 128 bits (PGAERR)",
            Self::Parallelism => "a write's width differs from PSIZE (PGPERR)",
            Self::Sequence => "a write without PG (PGSERR)",
            Self::Differs => "the flash differs from what was erased or programmed",
        })
    }
}

impl core::error::Error for FlashError {}

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Bounds => NorFlashErrorKind::OutOfBounds,
            Self::Alignment => NorFlashErrorKind::NotAligned,
            _ => NorFlashErrorKind::Other,
        }
    }
}

/// The flash from a 128 KB sector on: [`Part::memory`], whose first byte has address 0.
#[derive(Clone, Debug)]
pub struct Flash<P> {
    /// The part.
    pub part: P,
    /// Offset of the memory from the flash's first byte.
    begin: u32,
}

impl<P: Part> Flash<P> {
    /// Uses the memory of `part`, at the offset `begin` in the flash.
    pub const fn new(part: P, begin: u32) -> Self {
        Self { part, begin }
    }

    fn cells(&self, offset: u32, len: usize) -> Result<&[Cell<u8>], FlashError> {
        let from = usize::try_from(offset).map_err(|_| FlashError::Bounds)?;
        let to = from.checked_add(len).ok_or(FlashError::Bounds)?;
        self.part.memory().get(from..to).ok_or(FlashError::Bounds)
    }

    fn is_erased(&self, offset: u32, len: usize) -> Result<bool, FlashError> {
        Ok(self.cells(offset, len)?.iter().all(|byte| byte.get() == 0xff))
    }

    fn may_stall(&self) -> Result<(), FlashError> {
        if self.part.is_driving() {
            return Err(FlashError::Driving);
        }
        if self.part.is_supplied() { Ok(()) } else { Err(FlashError::Supply) }
    }

    fn erase_sector(&mut self, number: u32) -> Result<(), FlashError> {
        self.may_stall()?;
        let erased = self.part.with_watchdog_timeout(longest_erase(number), |part| {
            let erased = unlocked(part, |part| {
                let chosen = SER | number << SNB | WORDS;
                set(part, chosen)?;
                part.write(Register::Control, chosen | STRT);
                ended(part, ERASE_READS)
            });
            // Also after a failure, because some of the sector may be erased.
            flush(part);
            erased
        });
        erased.ok_or(FlashError::Watchdog)??;
        let Range { start, end } = sector(number);
        let is_erased = self.is_erased(start - self.begin, (end - start) as usize)?;
        if is_erased { Ok(()) } else { Err(FlashError::Differs) }
    }
}

/// Unlocks the controller, does `work`, and locks it.
fn unlocked<P: Part>(part: &mut P, work: impl FnOnce(&mut P) -> Result<(), FlashError>) -> Result<(), FlashError> {
    let is_locked = |part: &P| part.read(Register::Control) & LOCK != 0;
    wait(part, PROGRAM_READS)?;
    // Unexpected keys lock it until the next reset.
    if is_locked(part) {
        KEYS.into_iter().for_each(|key| part.write(Register::Key, key));
    }
    if is_locked(part) {
        return Err(FlashError::Locked);
    }
    // A debugger may have left flags.
    part.write(Register::Status, WRPERR | PGAERR | PGPERR | PGSERR);
    let outcome = work(part);
    part.write(Register::Control, LOCK);
    outcome
}

/// Sets FLASH_CR and checks that the controller accepted it.
fn set(part: &mut impl Part, control: u32) -> Result<(), FlashError> {
    part.write(Register::Control, control);
    if part.read(Register::Control) == control { Ok(()) } else { Err(FlashError::Settings) }
}

/// Reads BSY until it is 0.
fn wait(part: &impl Part, turns: u32) -> Result<(), FlashError> {
    let is_idle = (0..turns).any(|_| part.read(Register::Status) & BSY == 0);
    if is_idle { Ok(()) } else { Err(FlashError::Busy) }
}

/// Waits for the end of an operation and returns its outcome.
fn ended(part: &impl Part, turns: u32) -> Result<(), FlashError> {
    wait(part, turns)?;
    match part.read(Register::Status) {
        status if status & WRPERR != 0 => Err(FlashError::WriteProtected),
        status if status & PGAERR != 0 => Err(FlashError::Row),
        status if status & PGPERR != 0 => Err(FlashError::Parallelism),
        status if status & PGSERR != 0 => Err(FlashError::Sequence),
        _ => Ok(()),
    }
}

/// Invalidates the caches (section 3.6.3), which must be off for it. Programming updates the caches together with the
/// flash.
fn flush(part: &mut impl Part) {
    let access = part.read(Register::Access);
    let off = access & !(ICEN | DCEN);
    for value in [off, off | ICRST | DCRST, off, access] {
        part.write(Register::Access, value);
    }
}

impl<P> ErrorType for Flash<P> {
    type Error = FlashError;
}

impl<P: Part> ReadNorFlash for Flash<P> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        let cells = self.cells(offset, bytes.len())?;
        bytes.iter_mut().zip(cells).for_each(|(place, byte)| *place = byte.get());
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.part.memory().len()
    }
}

impl<P: Part> NorFlash for Flash<P> {
    const WRITE_SIZE: usize = 4;
    /// Size of the slots' sectors. Smaller sectors are erased as they are.
    const ERASE_SIZE: usize = LARGE as usize;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        self.cells(from, to.checked_sub(from).ok_or(FlashError::Bounds)? as usize)?;
        if from == to {
            return Ok(());
        }
        let with_edge = |edge: fn(u32) -> u32, at| {
            let found = (0..SECTORS).find(|number| edge(*number).checked_sub(self.begin) == Some(at));
            found.ok_or(FlashError::Alignment)
        };
        let first = with_edge(|number| sector(number).start, from)?;
        let last = with_edge(|number| sector(number).end, to)?;
        (first..=last).try_for_each(|number| self.erase_sector(number))
    }

    /// Programs each word once, except that a word of ones looks like an erased one. (The part itself would clear more
    /// ones a second time, without an error.)
    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        let (words, []) = bytes.as_chunks() else { return Err(FlashError::Alignment) };
        if !offset.is_multiple_of(4) {
            return Err(FlashError::Alignment);
        }
        if !self.is_erased(offset, bytes.len())? {
            return Err(FlashError::Programmed);
        }
        self.may_stall()?;
        unlocked(&mut self.part, |part| {
            set(part, PG | WORDS)?;
            (offset..).step_by(4).zip(words).try_for_each(|(at, word)| {
                part.program(at, u32::from_le_bytes(*word));
                ended(part, PROGRAM_READS)
            })
        })?;
        // The data cache also has the programmed words; flush it, so that the flash itself is read.
        flush(&mut self.part);
        let is_written = self.cells(offset, bytes.len())?.iter().zip(bytes).all(|(cell, byte)| cell.get() == *byte);
        if is_written { Ok(()) } else { Err(FlashError::Differs) }
    }
}

#[cfg(test)]
mod tests;
