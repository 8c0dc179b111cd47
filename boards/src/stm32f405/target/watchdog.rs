//! The independent watchdog (RM0090, section 21). `../watchdog_time.rs` has the length of its ticks.

use core::sync::atomic::{AtomicU16, Ordering};

use cortex_m::asm;
use cortex_m::peripheral::DWT;
use stm32f4::stm32f405 as pac;
use stm32f4::stm32f405::iwdg::RegisterBlock;

use super::wait::wait;
use crate::hal::Watchdog;
use crate::stm32f405::watchdog_time::{MAX_TICKS, ticks};

const OPEN: u16 = 0x5555;
const START: u16 = 0xcccc;
const FEED: u16 = 0xaaaa;

/// Divides by 32: a tick is about a millisecond.
const DIVIDER: u8 = 3;
/// Largest number of reads until the registers are updated, which takes at most 5 cycles of 17 kHz. If they are not,
/// the watchdog starts with its reset values.
const UPDATE_READS: u32 = 1_000_000;

/// The ticks of the last [`Watchdog::start`]. (The register has them only after its update.)
static TICKS: AtomicU16 = AtomicU16::new(MAX_TICKS - 1);

/// The independent watchdog.
#[derive(Debug)]
pub struct Iwdg(pac::IWDG);

impl Iwdg {
    pub(super) fn new(iwdg: pac::IWDG) -> Self {
        Self(iwdg)
    }
}

fn key(iwdg: &RegisterBlock, key: u16) {
    // SAFETY: the register takes any key, and ignores unknown ones.
    iwdg.kr().write(|w| unsafe { w.bits(key) });
}

/// Sets the timeout to `ticks` + 1 ticks and restarts it; returns `false` if the registers are not updated.
fn set(iwdg: &RegisterBlock, ticks: u16) -> bool {
    key(iwdg, OPEN);
    // SAFETY: values in the fields' ranges: 3 of 0 to 7, 12 bits.
    unsafe {
        iwdg.pr().write(|w| w.pr().bits(DIVIDER));
        iwdg.rlr().write(|w| w.rl().bits(ticks & (MAX_TICKS - 1)));
    }
    let taken = wait(UPDATE_READS, || iwdg.sr().read().bits() == 0);
    if taken {
        key(iwdg, FEED);
    }
    taken
}

/// Does `work` with a timeout of at least `milliseconds`, then restores the previous one. Returns `None`, with nothing
/// done, if the watchdog does not accept the timeout. Only the loop that feeds the watchdog may call it. If the work
/// took longer, measured in core cycles (`khz` in a millisecond), it does not return, and the watchdog resets the
/// board. The same happens if the previous timeout cannot be restored.
pub(super) fn with_watchdog_timeout<R>(milliseconds: u16, khz: u32, work: impl FnOnce() -> R) -> Option<R> {
    // SAFETY: the registers exist as long as the program runs; only the loop, which waits for this function, writes
    // them.
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
        if !(1..=MAX_TICKS).contains(&milliseconds) {
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
