//! The independent watchdog (RM0090, section 21), which has an oscillator of its own: 32 kHz, in truth 17 to 47 kHz.

use stm32f4::stm32f405 as pac;

use super::wait;
use crate::seams::Watchdog;

const OPEN: u16 = 0x5555;
const START: u16 = 0xcccc;
const FEED: u16 = 0xaaaa;

/// Divided by 32: a tick is about a millisecond.
const DIVIDER: u8 = 3;
const LONGEST: u16 = 4096;
/// Reads until the registers count as taken; they take 5 cycles of 17 kHz at most, and the watchdog starts with its reset values
/// where they do not.
const TAKEN: u32 = 100_000;

/// The independent watchdog.
#[derive(Debug)]
pub struct Iwdg(pac::IWDG);

impl Iwdg {
    pub(super) fn new(iwdg: pac::IWDG) -> Self {
        Self(iwdg)
    }

    fn key(&self, key: u16) {
        // SAFETY: the register takes any key, and does nothing on those that it does not know.
        self.0.kr().write(|w| unsafe { w.bits(key) });
    }
}

impl Watchdog for Iwdg {
    fn start(&mut self, milliseconds: u16) -> bool {
        if !(1..=LONGEST).contains(&milliseconds) {
            return false;
        }
        self.key(START);
        self.key(OPEN);
        // SAFETY: values in the fields' ranges: 3 of 0 to 7, at most 4095 of 12 bits.
        unsafe {
            self.0.pr().write(|w| w.pr().bits(DIVIDER));
            self.0.rlr().write(|w| w.rl().bits(milliseconds - 1));
        }
        let taken = wait(TAKEN, || self.0.sr().read().bits() == 0);
        self.feed();
        taken
    }

    fn feed(&mut self) {
        self.key(FEED);
    }
}
