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
mod tests {
    use super::model::Model;
    use super::*;

    /// Returns the whole flash, filled with `byte`.
    fn flash(byte: u8) -> Flash<Model> {
        let end = sector(SECTORS - 1).end;
        Flash::new(Model::new(vec![byte; end as usize], 0, 1), 0)
    }

    /// Returns `true` if the controller is locked and no cache is stale, as after each request.
    fn is_at_rest(flash: &Flash<Model>) -> bool {
        flash.part.read(Register::Control) == LOCK && !flash.part.is_stale
    }

    #[test]
    fn the_sectors_cover_a_megabyte() {
        let lengths: Vec<u32> = (0..SECTORS).map(|number| sector(number).len() as u32 >> 10).collect();
        assert_eq!(lengths, [16, 16, 16, 16, 64, 128, 128, 128, 128, 128, 128, 128]);
        for number in 1..SECTORS {
            assert_eq!(sector(number - 1).end, sector(number).start);
        }
        assert_eq!((sector(0).start, sector(SECTORS - 1).end), (0, 1 << 20));
    }

    #[test]
    fn each_sector_is_erased_separately() {
        for number in 0..SECTORS {
            let mut flash = flash(0x5a);
            let Range { start, end } = sector(number);
            assert_eq!(flash.erase(start, end), Ok(()), "{number}");
            let mut expected = vec![0x5a; flash.capacity()];
            expected[start as usize..end as usize].fill(0xff);
            assert!(flash.part.bytes() == expected && is_at_rest(&flash), "{number}");
        }
        // Several sectors, relative to the writable memory.
        let mut flash = Flash::new(Model::new(vec![0; 4 * LARGE as usize], 4 * LARGE, 1), 4 * LARGE);
        assert_eq!(flash.erase(LARGE, 3 * LARGE), Ok(()));
        let erased: Vec<bool> = flash.part.bytes().chunks(LARGE as usize).map(|part| part[0] == 0xff).collect();
        assert_eq!(erased, [false, true, true, false]);
    }

    #[test]
    fn a_word_is_programmed_once() {
        let mut flash = flash(0xff);
        assert_eq!(flash.write(8, b"flash___"), Ok(()));
        let mut bytes = [0; 10];
        assert_eq!(flash.read(7, &mut bytes), Ok(()));
        assert_eq!((&bytes, is_at_rest(&flash)), (b"\xffflash___\xff", true));
        let before = flash.part.power.done;
        assert_eq!(flash.write(12, &[0; 4]), Err(FlashError::Programmed));
        assert_eq!(flash.part.power.done, before, "nothing was told");
    }

    #[test]
    fn misaligned_and_out_of_bounds_requests_are_refused() {
        use FlashError::{Alignment, Bounds};
        let mut flash = flash(0xff);
        let end = flash.capacity() as u32;
        assert_eq!([flash.write(2, &[0; 4]), flash.write(4, &[0; 3])], [Err(Alignment); 2]);
        assert_eq!([flash.write(end, &[0; 4]), flash.write(u32::MAX - 3, &[0; 8])], [Err(Bounds); 2]);
        assert_eq!([flash.erase(0, 4), flash.erase(4, LARGE), flash.erase(0, 3 * LARGE - 4)], [Err(Alignment); 3]);
        assert_eq!([flash.erase(LARGE, 0), flash.erase(0, end + LARGE)], [Err(Bounds); 2]);
        assert_eq!((flash.erase(LARGE, LARGE), flash.read(end, &mut [0])), (Ok(()), Err(Bounds)));
        assert_eq!(flash.part.power.done, 0);
    }

    /// A failed precondition refuses the request, with nothing written to the controller.
    #[test]
    fn unsafe_requests_do_not_start() {
        let refused = |change: fn(&mut Model)| {
            let mut flash = flash(0xff);
            change(&mut flash.part);
            let outcomes = [flash.erase(0, LARGE), flash.write(0, &[0; 4])];
            (outcomes, flash.part.power.done)
        };
        assert_eq!(refused(|part| part.is_driving = true), ([Err(FlashError::Driving); 2], 0));
        assert_eq!(refused(|part| part.is_supplied = false), ([Err(FlashError::Supply); 2], 0));
        // A word needs no other timeout.
        let (outcomes, _) = refused(|part| part.accepts_timeout = false);
        assert_eq!(outcomes, [Err(FlashError::Watchdog), Ok(())]);
    }

    #[test]
    fn controller_errors_are_named_and_lock_it() {
        for (flags, error) in [
            (WRPERR, FlashError::WriteProtected),
            (PGAERR, FlashError::Row),
            (PGPERR, FlashError::Parallelism),
            (PGSERR, FlashError::Sequence),
        ] {
            let mut flash = flash(0xff);
            flash.part.raises = flags;
            assert_eq!([flash.erase(0, LARGE), flash.write(0, &[0; 8])], [Err(error); 2]);
            assert!(is_at_rest(&flash), "{error}");
            // The flags of one request do not affect the next one.
            flash.part.raises = 0;
            assert_eq!([flash.write(0, &[0; 8]), flash.erase(0, LARGE)], [Ok(()); 2], "{error}");
        }
        let mut flash = flash(0xff);
        flash.part.protected = 1 << 3;
        let Range { start, end } = sector(3);
        assert_eq!([flash.erase(start, end), flash.write(start, &[0; 4])], [Err(FlashError::WriteProtected); 2]);
        assert_eq!(flash.write(end, &[0; 4]), Ok(()));
    }

    #[test]
    fn a_hung_locked_or_missing_controller_is_detected() {
        let mut endless = flash(0xff);
        endless.part.takes = u32::MAX;
        assert_eq!(endless.write(0, &[0; 4]), Err(FlashError::Busy));
        // During an erase the watchdog detects it.
        assert_eq!((endless.erase(0, LARGE), endless.part.is_reset), (Err(FlashError::Watchdog), true));
        let mut locked = flash(0xff);
        locked.part.write(Register::Key, KEYS[1]);
        assert_eq!([locked.erase(0, LARGE), locked.write(0, &[0; 4])], [Err(FlashError::Locked); 2]);
        locked.part = locked.part.restarted();
        assert_eq!(locked.write(0, &[0; 4]), Ok(()));
        let mut none = flash(0xff);
        none.part.exists = false;
        assert_eq!([none.erase(0, LARGE), none.write(0, &[0; 4])], [Err(FlashError::Settings); 2]);
    }

    /// The watchdog waits for the data sheet's erase time, and is not fed after a longer erase.
    #[test]
    fn an_overlong_erase_ends_in_a_reset() {
        for number in 0..SECTORS {
            let Range { start, end } = sector(number);
            let erased_in = |milliseconds| {
                let mut flash = flash(0);
                flash.part.takes = milliseconds;
                (flash.erase(start, end), flash.part.is_reset)
            };
            let longest = longest_erase(number).into();
            assert_eq!(erased_in(longest), (Ok(()), false), "{number}");
            assert_eq!(erased_in(longest + 1), (Err(FlashError::Watchdog), true), "{number}");
        }
    }

    /// The model enforces the rules of the part that the sequences follow.
    #[test]
    fn the_model_refuses_what_the_part_refuses() {
        let outcome_of = |control: &[u32], at| {
            let mut part = Model::new(vec![0xff; 64], 0, 1);
            if !control.is_empty() {
                KEYS.into_iter().for_each(|key| part.write(Register::Key, key));
            }
            control.iter().for_each(|control| part.write(Register::Control, *control));
            part.program(at, 0);
            let written = part.bytes().contains(&0);
            (part.read(Register::Status) & !BSY, written)
        };
        assert_eq!(outcome_of(&[], 0), (PGSERR, false), "locked");
        assert_eq!(outcome_of(&[WORDS], 0), (PGSERR, false), "without PG");
        assert_eq!(outcome_of(&[PG | WORDS, LOCK], 0), (PGSERR, false), "locked again");
        assert_eq!(outcome_of(&[PG], 0), (PGPERR, false), "bytes");
        assert_eq!(outcome_of(&[PG | WORDS], 14), (PGAERR, false), "over two rows");
        assert_eq!(outcome_of(&[PG | WORDS], 12), (0, true));
    }

    /// If the supply fails during a request, nothing outside it changes, and it can be repeated.
    #[test]
    fn an_interrupted_request_can_be_repeated() {
        let (slot, other) = (8 * LARGE - LARGE, 6 * LARGE);
        let mut fresh = Flash::new(Model::new(vec![0x33; 2 * LARGE as usize], other, 5), other);
        fresh.part.takes = 1;
        let words: Vec<u8> = (0..40).collect();
        let request = |flash: &mut Flash<Model>| {
            flash.erase(slot - other, slot - other + LARGE).and_then(|()| flash.write(LARGE + 8, &words))
        };
        let mut whole = fresh.clone();
        assert_eq!(request(&mut whole), Ok(()));
        for fails_at in 0..whole.part.power.done {
            let mut flash = fresh.clone();
            flash.part.power.fails_at = Some(fails_at);
            // Only what closes the controller, and the four writes that empty the caches, may be missing.
            let outcome = request(&mut flash);
            assert_eq!(outcome.is_ok(), fails_at + 5 >= whole.part.power.done, "{fails_at}");
            assert!(flash.part.bytes()[..LARGE as usize].iter().all(|byte| *byte == 0x33), "{fails_at}");
            flash.part = flash.part.restarted();
            assert_eq!(request(&mut flash), Ok(()), "{fails_at}");
            assert!(flash.part.bytes() == whole.part.bytes() && is_at_rest(&flash), "{fails_at}");
        }
    }
}
