//! The flash of an STM32F405, erased and programmed (RM0090, section 3.6): in which order its controller is told what,
//! what has to hold before, and its errors by name. The registers are behind [`Part`], so that all of it runs on the
//! host, too, on a [`model`].
//!
//! The part has one bank: while a sector is erased, for up to 2 s, or a word is programmed, up to 0.1 ms, the processor
//! stands still as soon as it fetches an instruction or reads from flash, its interrupts with it. So nothing begins
//! unless the power stage is off by its register, and no sector is erased but with a watchdog that waits for as long as
//! the data sheet gives it, and is fed behind that only where it took no longer. Where the controller itself does not
//! come to an end, that watchdog does.

#[cfg(not(target_os = "none"))]
pub mod model;

use core::cell::Cell;
use core::fmt;
use core::ops::Range;

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};

/// Sectors: 4 of 16 KB, one of 64 KB, 7 of 128 KB (section 3.4).
pub const SECTORS: u32 = 12;
/// Bytes of a sector from the sixth on, which slots for images consist of.
pub const LARGE: u32 = 128 << 10;

/// The addresses of a sector, from the flash's first byte on.
pub const fn sector(number: u32) -> Range<u32> {
    const SMALL: u32 = 16 << 10;
    match number {
        0..=3 => number * SMALL..(number + 1) * SMALL,
        4 => 4 * SMALL..LARGE,
        _ => (number - 4) * LARGE..(number - 3) * LARGE,
    }
}

/// Milliseconds that the erase of a sector takes at most, in words (data sheet DS8626, characteristics of the flash,
/// x32).
pub const fn longest_erase(number: u32) -> u16 {
    match number {
        0..=3 => 500,
        4 => 1100,
        _ => 2000,
    }
}

/// A register of the flash's controller (section 3.9).
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

/// What opens FLASH_CR, one after the other.
const KEYS: [u32; 2] = [0x4567_0123, 0xcdef_89ab];
// FLASH_SR: flags that are cleared by writing them.
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

/// Reads of BSY until a word, or a sector, counts as not done. A turn takes 4 cycles at least: above 0.1 ms and 2 s at
/// 168 MHz.
const PROGRAMMED: u32 = 17_000;
const ERASED: u32 = 84_000_000;

/// What the sequences need of the part.
pub trait Part {
    /// A register's value.
    fn read(&self, register: Register) -> u32;

    /// Sets a register.
    fn write(&mut self, register: Register, value: u32);

    /// The memory that is written.
    fn memory(&self) -> &[Cell<u8>];

    /// Writes a word to the memory in one access, at a multiple of 4 within it.
    fn program(&mut self, at: u32, word: u32);

    /// Whether the power stage is on.
    fn is_driving(&self) -> bool;

    /// Whether the supply has the voltage that words need.
    fn is_supplied(&self) -> bool;

    /// Does `work` while the watchdog waits for so many milliseconds, and gives it its own time again. `None` where it
    /// does not take that time, with nothing done. Where the work has taken longer, nothing feeds the watchdog any
    /// more, and it resets the board.
    fn patiently<R>(&mut self, milliseconds: u16, work: impl FnOnce(&mut Self) -> R) -> Option<R>;
}

/// Why a request was not done, or not to its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FlashError {
    /// It is not within the memory.
    Bounds,
    /// It does not begin and end between two words, or two sectors.
    Alignment,
    /// What is to be programmed is not erased.
    Programmed,
    /// The power stage is on.
    Driving,
    /// The supply is below the voltage that programming needs.
    Supply,
    /// The watchdog does not take another time.
    Watchdog,
    /// The controller does not open.
    Locked,
    /// The controller does not take what it is told, or is none.
    Settings,
    /// The controller does not come to an end.
    Busy,
    /// WRPERR.
    WriteProtected,
    /// PGAERR.
    Row,
    /// PGPERR.
    Parallelism,
    /// PGSERR.
    Sequence,
    /// The memory is not as it was erased or programmed.
    Differs,
}

impl fmt::Display for FlashError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Bounds => "not within the flash that may be written",
            Self::Alignment => "not between two words or sectors",
            Self::Programmed => "not erased before it is programmed",
            Self::Driving => "the power stage is on; disarm first",
            Self::Supply => "the supply is below 2.9 V",
            Self::Watchdog => "the watchdog does not take another time",
            Self::Locked => "the flash controller does not open (LOCK); only a reset helps",
            Self::Settings => "the flash controller does not take its settings; is there one?",
            Self::Busy => "the flash controller does not end (BSY)",
            Self::WriteProtected => "the sector is write-protected by the option bytes (WRPERR)",
            Self::Row => "a write crosses a row of 128 bits (PGAERR)",
            Self::Parallelism => "a write is not as wide as PSIZE says (PGPERR)",
            Self::Sequence => "a write came without PG (PGSERR)",
            Self::Differs => "the flash is not as it was erased or programmed",
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

/// The flash from some sector of 128 KB on: [`Part::memory`], whose first byte is address 0.
#[derive(Clone, Debug)]
pub struct Flash<P> {
    /// The part.
    pub part: P,
    /// Where the memory begins, from the flash's first byte on.
    begin: u32,
}

impl<P: Part> Flash<P> {
    /// The memory of `part`, which begins at `begin` of the whole flash.
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
        let erased = self.part.patiently(longest_erase(number), |part| {
            let erased = opened(part, |part| {
                let chosen = SER | number << SNB | WORDS;
                set(part, chosen)?;
                part.write(Register::Control, chosen | STRT);
                ended(part, ERASED)
            });
            // Also where it has failed: some of the sector may be erased.
            flush(part);
            erased
        });
        erased.ok_or(FlashError::Watchdog)??;
        let Range { start, end } = sector(number);
        let is_erased = self.is_erased(start - self.begin, (end - start) as usize)?;
        if is_erased { Ok(()) } else { Err(FlashError::Differs) }
    }
}

/// Opens the controller, does `work`, and closes it.
fn opened<P: Part>(part: &mut P, work: impl FnOnce(&mut P) -> Result<(), FlashError>) -> Result<(), FlashError> {
    let is_locked = |part: &P| part.read(Register::Control) & LOCK != 0;
    wait(part, PROGRAMMED)?;
    // Keys that it does not wait for lock it until the next reset.
    if is_locked(part) {
        KEYS.into_iter().for_each(|key| part.write(Register::Key, key));
    }
    if is_locked(part) {
        return Err(FlashError::Locked);
    }
    // What a debugger may have left.
    part.write(Register::Status, WRPERR | PGAERR | PGPERR | PGSERR);
    let outcome = work(part);
    part.write(Register::Control, LOCK);
    outcome
}

/// Sets FLASH_CR, and sees whether it was taken.
fn set(part: &mut impl Part, control: u32) -> Result<(), FlashError> {
    part.write(Register::Control, control);
    if part.read(Register::Control) == control { Ok(()) } else { Err(FlashError::Settings) }
}

/// Reads BSY until it is 0.
fn wait(part: &impl Part, turns: u32) -> Result<(), FlashError> {
    let is_idle = (0..turns).any(|_| part.read(Register::Status) & BSY == 0);
    if is_idle { Ok(()) } else { Err(FlashError::Busy) }
}

/// Waits for the end of what was begun, and says how it has ended.
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

/// Forgets what the caches have (section 3.6.3), which must be off for it. Programming changes what they have together
/// with the flash.
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
    /// Of the sectors of slots. Smaller ones are erased as they are.
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

    /// Nothing tells from an erased word one that was programmed with ones; every other word is programmed once. (The
    /// part itself would take ones away a second time, without an error.)
    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        let (words, []) = bytes.as_chunks() else { return Err(FlashError::Alignment) };
        if !offset.is_multiple_of(4) {
            return Err(FlashError::Alignment);
        }
        if !self.is_erased(offset, bytes.len())? {
            return Err(FlashError::Programmed);
        }
        self.may_stall()?;
        opened(&mut self.part, |part| {
            set(part, PG | WORDS)?;
            (offset..).step_by(4).zip(words).try_for_each(|(at, word)| {
                part.program(at, u32::from_le_bytes(*word));
                ended(part, PROGRAMMED)
            })
        })?;
        // What was programmed is in the data cache, too: from here on the flash itself is read.
        flush(&mut self.part);
        let is_written = self.cells(offset, bytes.len())?.iter().zip(bytes).all(|(cell, byte)| cell.get() == *byte);
        if is_written { Ok(()) } else { Err(FlashError::Differs) }
    }
}

#[cfg(test)]
mod tests {
    use super::model::Model;
    use super::*;

    /// All of the flash, full of `byte`.
    fn flash(byte: u8) -> Flash<Model> {
        let end = sector(SECTORS - 1).end;
        Flash::new(Model::new(vec![byte; end as usize], 0, 1), 0)
    }

    /// After each request the controller is closed, and no cache has what was erased.
    fn is_at_rest(flash: &Flash<Model>) -> bool {
        flash.part.read(Register::Control) == LOCK && !flash.part.is_stale
    }

    #[test]
    fn the_sectors_are_those_of_a_megabyte() {
        let lengths: Vec<u32> = (0..SECTORS).map(|number| sector(number).len() as u32 >> 10).collect();
        assert_eq!(lengths, [16, 16, 16, 16, 64, 128, 128, 128, 128, 128, 128, 128]);
        for number in 1..SECTORS {
            assert_eq!(sector(number - 1).end, sector(number).start);
        }
        assert_eq!((sector(0).start, sector(SECTORS - 1).end), (0, 1 << 20));
    }

    #[test]
    fn each_sector_is_erased_alone() {
        for number in 0..SECTORS {
            let mut flash = flash(0x5a);
            let Range { start, end } = sector(number);
            assert_eq!(flash.erase(start, end), Ok(()), "{number}");
            let mut expected = vec![0x5a; flash.capacity()];
            expected[start as usize..end as usize].fill(0xff);
            assert!(flash.part.bytes() == expected && is_at_rest(&flash), "{number}");
        }
        // Several, from the begin of what is written.
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
        let before = flash.part.done;
        assert_eq!(flash.write(12, &[0; 4]), Err(FlashError::Programmed));
        assert_eq!(flash.part.done, before, "nothing was told");
    }

    #[test]
    fn what_is_not_words_or_sectors_or_not_there_is_refused() {
        use FlashError::{Alignment, Bounds};
        let mut flash = flash(0xff);
        let end = flash.capacity() as u32;
        assert_eq!([flash.write(2, &[0; 4]), flash.write(4, &[0; 3])], [Err(Alignment); 2]);
        assert_eq!([flash.write(end, &[0; 4]), flash.write(u32::MAX - 3, &[0; 8])], [Err(Bounds); 2]);
        assert_eq!([flash.erase(0, 4), flash.erase(4, LARGE), flash.erase(0, 3 * LARGE - 4)], [Err(Alignment); 3]);
        assert_eq!([flash.erase(LARGE, 0), flash.erase(0, end + LARGE)], [Err(Bounds); 2]);
        assert_eq!((flash.erase(LARGE, LARGE), flash.read(end, &mut [0])), (Ok(()), Err(Bounds)));
        assert_eq!(flash.part.done, 0);
    }

    /// What a condition refuses, with nothing told to the controller.
    #[test]
    fn nothing_begins_that_would_not_be_safe() {
        let refused = |change: fn(&mut Model)| {
            let mut flash = flash(0xff);
            change(&mut flash.part);
            let outcomes = [flash.erase(0, LARGE), flash.write(0, &[0; 4])];
            (outcomes, flash.part.done)
        };
        assert_eq!(refused(|part| part.is_driving = true), ([Err(FlashError::Driving); 2], 0));
        assert_eq!(refused(|part| part.is_supplied = false), ([Err(FlashError::Supply); 2], 0));
        // A word needs no other time of the watchdog.
        let (outcomes, _) = refused(|part| part.is_lenient = false);
        assert_eq!(outcomes, [Err(FlashError::Watchdog), Ok(())]);
    }

    #[test]
    fn what_the_controller_says_is_told_by_name_and_closes_it() {
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
            // The flags of one request are not those of the next one.
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
    fn a_controller_that_does_not_end_open_or_exist_is_noticed() {
        let mut endless = flash(0xff);
        endless.part.takes = u32::MAX;
        assert_eq!(endless.write(0, &[0; 4]), Err(FlashError::Busy));
        // Of an erase the watchdog notices it.
        assert_eq!((endless.erase(0, LARGE), endless.part.is_reset), (Err(FlashError::Watchdog), true));
        let mut locked = flash(0xff);
        locked.part.write(Register::Key, KEYS[1]);
        assert_eq!([locked.erase(0, LARGE), locked.write(0, &[0; 4])], [Err(FlashError::Locked); 2]);
        locked.part = locked.part.restarted();
        assert_eq!(locked.write(0, &[0; 4]), Ok(()));
        let mut none = flash(0xff);
        none.part.is_there = false;
        assert_eq!([none.erase(0, LARGE), none.write(0, &[0; 4])], [Err(FlashError::Settings); 2]);
    }

    /// The watchdog waits for what the data sheet gives a sector, and is not fed behind an erase that has taken longer.
    #[test]
    fn an_erase_that_takes_longer_than_it_may_ends_in_a_reset() {
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

    /// The model has the rules that the sequences keep: without them the part refuses, too.
    #[test]
    fn the_model_refuses_what_the_part_refuses() {
        let told = |control: &[u32], at| {
            let mut part = Model::new(vec![0xff; 64], 0, 1);
            if !control.is_empty() {
                KEYS.into_iter().for_each(|key| part.write(Register::Key, key));
            }
            control.iter().for_each(|control| part.write(Register::Control, *control));
            part.program(at, 0);
            let written = part.bytes().contains(&0);
            (part.read(Register::Status) & !BSY, written)
        };
        assert_eq!(told(&[], 0), (PGSERR, false), "locked");
        assert_eq!(told(&[WORDS], 0), (PGSERR, false), "without PG");
        assert_eq!(told(&[PG | WORDS, LOCK], 0), (PGSERR, false), "locked again");
        assert_eq!(told(&[PG], 0), (PGPERR, false), "bytes");
        assert_eq!(told(&[PG | WORDS], 14), (PGAERR, false), "over two rows");
        assert_eq!(told(&[PG | WORDS], 12), (0, true));
    }

    /// Wherever the supply fails in the course of a request, nothing outside of it has changed, and it can be done
    /// again.
    #[test]
    fn a_request_that_was_cut_short_can_be_done_again() {
        let (slot, other) = (8 * LARGE - LARGE, 6 * LARGE);
        let mut fresh = Flash::new(Model::new(vec![0x33; 2 * LARGE as usize], other, 5), other);
        fresh.part.takes = 1;
        let words: Vec<u8> = (0..40).collect();
        let request = |flash: &mut Flash<Model>| {
            flash.erase(slot - other, slot - other + LARGE).and_then(|()| flash.write(LARGE + 8, &words))
        };
        let mut whole = fresh.clone();
        assert_eq!(request(&mut whole), Ok(()));
        for fails_at in 0..whole.part.done {
            let mut flash = fresh.clone();
            flash.part.fails_at = Some(fails_at);
            // Only what closes the controller, and the four writes that empty the caches, may be missing.
            let outcome = request(&mut flash);
            assert_eq!(outcome.is_ok(), fails_at + 5 >= whole.part.done, "{fails_at}");
            assert!(flash.part.bytes()[..LARGE as usize].iter().all(|byte| *byte == 0x33), "{fails_at}");
            flash.part = flash.part.restarted();
            assert_eq!(request(&mut flash), Ok(()), "{fails_at}");
            assert!(flash.part.bytes() == whole.part.bytes() && is_at_rest(&flash), "{fails_at}");
        }
    }
}
