//! The clock (RM0090, sections 3.5.1, 5.1.3 and 7.2): an 8 MHz crystal, multiplied to 168 MHz. If one of the steps
//! times out, the internal 16 MHz oscillator.

use stm32f4::stm32f405 as pac;

use super::wait::wait;
use crate::hal::{Clock, Source};

const FALLBACK: Clock = Clock { hz: 16_000_000, source: Source::Fallback };
const FAST: Clock = Clock { hz: 168_000_000, source: Source::Crystal };

/// Reads of a flag before a crystal counts as dead: above 100 ms at 16 MHz, as a read takes at least 10 cycles. A good
/// crystal takes about 2 ms.
const CRYSTAL: u32 = 160_000;
/// Reads of a flag before the PLL, which locks within 0.3 ms, or a clock switch counts as dead.
const LOCK: u32 = 16_000;

/// Wait states of the flash at 168 MHz and 2.7 to 3.6 V.
const WAIT_STATES: u8 = 5;

/// Selections of the system clock.
const HSI: u8 = 0;
const PLL: u8 = 2;

pub(super) fn start(rcc: &pac::RCC, flash: &pac::FLASH, power: &pac::PWR) -> Clock {
    if fast(rcc, flash, power) {
        return FAST;
    }
    // The flash's wait states stay: too many are slow but safe. SAFETY: 0 is the internal oscillator, which runs: the
    // part starts with it, and nothing switches it off.
    rcc.cfgr().modify(|_, w| unsafe { w.sw().bits(HSI).hpre().bits(0).ppre1().bits(0).ppre2().bits(0) });
    rcc.cr().modify(|_, w| w.pllon().clear_bit().hseon().clear_bit());
    FALLBACK
}

pub(super) fn running(rcc: &pac::RCC) -> Clock {
    if rcc.cfgr().read().sws().bits() == PLL { FAST } else { FALLBACK }
}

/// Returns the frequency of the peripherals on APB2 in Hz.
pub(super) fn apb2(clock: Clock) -> u32 {
    match clock.source {
        Source::Crystal => clock.hz / 2,
        Source::Fallback => clock.hz,
    }
}

fn fast(rcc: &pac::RCC, flash: &pac::FLASH, power: &pac::PWR) -> bool {
    rcc.cr().modify(|_, w| w.hseon().set_bit());
    if !wait(CRYSTAL, || rcc.cr().read().hserdy().bit()) {
        return false;
    }
    // More than 144 MHz need the regulator's higher voltage.
    rcc.apb1enr().modify(|_, w| w.pwren().set_bit());
    // A peripheral's clock starts two cycles after it is enabled (errata sheet ES0182).
    let _ = rcc.apb1enr().read();
    power.cr().modify(|_, w| w.vos().set_bit());
    // 8 MHz / 4 * 168 / 2 = 168 MHz; / 7 of 336 MHz are 48 MHz for USB. SAFETY: within the ranges of section 7.3.2:
    // input of 1 to 2 MHz, VCO of 100 to 432 MHz; a field of 0 divides by 2.
    rcc.pllcfgr()
        .write(|w| unsafe { w.pllm().bits(4).plln().bits(168).pllp().bits(0).pllq().bits(7).pllsrc().set_bit() });
    rcc.cr().modify(|_, w| w.pllon().set_bit());
    if !wait(LOCK, || rcc.cr().read().pllrdy().bit()) {
        return false;
    }
    // SAFETY: the value is in the field's range.
    flash
        .acr()
        .modify(|_, w| unsafe { w.latency().bits(WAIT_STATES).prften().set_bit().icen().set_bit().dcen().set_bit() });
    if !wait(LOCK, || flash.acr().read().latency().bits() == WAIT_STATES) {
        return false;
    }
    // SAFETY: buses at their highest, 42 MHz (divided by 4) and 84 MHz (by 2), before the core's clock is switched.
    rcc.cfgr().modify(|_, w| unsafe { w.hpre().bits(0).ppre1().bits(0b101).ppre2().bits(0b100).sw().bits(PLL) });
    if !wait(LOCK, || running(rcc) == FAST) {
        return false;
    }
    // If the crystal stops, the part goes on from the internal oscillator, the power stage's outputs go off (section
    // 17.3.12), and a non-maskable interrupt comes, whose handler in the application resets. A handler that returns
    // must clear the flag (CSSC).
    rcc.cr().modify(|_, w| w.csson().set_bit());
    true
}
