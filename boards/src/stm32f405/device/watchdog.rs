//! The independent watchdog (RM0090, section 21). How long its ticks are is in `../patience.rs`.

use core::sync::atomic::{AtomicU16, Ordering};

use cortex_m::asm;
use cortex_m::peripheral::DWT;
use stm32f4::stm32f405 as pac;
use stm32f4::stm32f405::iwdg::RegisterBlock;

use super::wait::wait;
use crate::seams::Watchdog;
use crate::stm32f405::patience::{LONGEST, ticks};

const OPEN: u16 = 0x5555;
const START: u16 = 0xcccc;
const FEED: u16 = 0xaaaa;

/// Divided by 32: a tick is about a millisecond.
const DIVIDER: u8 = 3;
/// Reads until the registers count as taken; they take 5 cycles of 17 kHz at most, and the watchdog starts with its
/// reset values where they do not.
const TAKEN: u32 = 1_000_000;

/// The ticks that [`Watchdog::start`] was asked for. (The register has them only once they are taken.)
static TICKS: AtomicU16 = AtomicU16::new(LONGEST - 1);

/// The independent watchdog.
#[derive(Debug)]
pub struct Iwdg(pac::IWDG);

impl Iwdg {
    pub(super) fn new(iwdg: pac::IWDG) -> Self {
        Self(iwdg)
    }
}

fn key(iwdg: &RegisterBlock, key: u16) {
    // SAFETY: the register takes any key, and does nothing on those that it does not know.
    iwdg.kr().write(|w| unsafe { w.bits(key) });
}

/// Sets the time anew to so many ticks and one, and starts it; false where that is not taken.
fn set(iwdg: &RegisterBlock, ticks: u16) -> bool {
    key(iwdg, OPEN);
    // SAFETY: values in the fields' ranges: 3 of 0 to 7, 12 bits.
    unsafe {
        iwdg.pr().write(|w| w.pr().bits(DIVIDER));
        iwdg.rlr().write(|w| w.rl().bits(ticks & (LONGEST - 1)));
    }
    let taken = wait(TAKEN, || iwdg.sr().read().bits() == 0);
    if taken {
        key(iwdg, FEED);
    }
    taken
}

/// Does `work` with a time of so many milliseconds at least, and sets the one before again; `None` where the first one
/// is not taken, with nothing done. To be called where the watchdog is fed: by the loop. Where the work has taken
/// longer, by the cycles of the core, of which `khz` are a millisecond, or where its own time is not taken again, it
/// does not return, and the watchdog resets the board.
pub(super) fn patiently<R>(milliseconds: u16, khz: u32, work: impl FnOnce() -> R) -> Option<R> {
    // SAFETY: the registers are there for as long as the program runs; besides the loop, which waits for this, nothing
    // writes them.
    let iwdg = unsafe { &*pac::IWDG::ptr() };
    let outcome = set(iwdg, ticks(milliseconds)).then(|| {
        let begun = DWT::cycle_count();
        let outcome = work();
        if DWT::cycle_count().wrapping_sub(begun) > khz.saturating_mul(milliseconds.into()) {
            loop {
                asm::nop();
            }
        }
        outcome
    });
    while !set(iwdg, TICKS.load(Ordering::Relaxed)) {}
    outcome
}

impl Watchdog for Iwdg {
    fn start(&mut self, milliseconds: u16) -> bool {
        if !(1..=LONGEST).contains(&milliseconds) {
            return false;
        }
        TICKS.store(milliseconds - 1, Ordering::Relaxed);
        key(&self.0, START);
        set(&self.0, milliseconds - 1)
    }

    fn feed(&mut self) {
        key(&self.0, FEED);
    }
}
