//! The registers of the flash controller (RM0090, section 3.9) and the supply voltage detector (section 5.2.3), and the
//! preconditions of a stalled processor. `../flash.rs` has the sequences. QEMU does not emulate these registers: they
//! read as 0.

use core::cell::Cell;

use stm32f4::stm32f405 as pac;

use super::{clock, pwm, watchdog};
use crate::stm32f405::flash::{Part, Register};

/// The detector's highest threshold, 2.9 V: including its tolerance it is above the 2.7 V that programming words needs.
const VOLTAGE: u8 = 0b111;

/// The flash controller and the part of the flash that it may write.
#[derive(Debug)]
pub struct Controller {
    registers: pac::FLASH,
    power: pac::PWR,
    memory: &'static [Cell<u8>],
    /// Core clock in kHz.
    khz: u32,
}

impl Controller {
    pub(super) fn new(registers: pac::FLASH, power: pac::PWR, rcc: &pac::RCC, memory: &'static [Cell<u8>]) -> Self {
        rcc.apb1enr().modify(|_, w| w.pwren().set_bit());
        // A clock is there two cycles after it is switched on (errata sheet ES0182).
        let _ = rcc.apb1enr().read();
        // SAFETY: the value is in the field's range.
        power.cr().modify(|_, w| unsafe { w.pls().bits(VOLTAGE).pvde().set_bit() });
        Self { registers, power, memory, khz: clock::running(rcc).hz / 1000 }
    }
}

impl Part for Controller {
    fn read(&self, register: Register) -> u32 {
        match register {
            Register::Access => self.registers.acr().read().bits(),
            // The register is write-only.
            Register::Key => 0,
            Register::Status => self.registers.sr().read().bits(),
            Register::Control => self.registers.cr().read().bits(),
        }
    }

    fn write(&mut self, register: Register, value: u32) {
        // SAFETY: any value is allowed; the controller only changes memory in its sectors, of which `../flash.rs`
        // selects those of `memory`, whose cells may change.
        unsafe {
            match register {
                Register::Access => self.registers.acr().write(|w| w.bits(value)),
                Register::Key => self.registers.keyr().write(|w| w.bits(value)),
                Register::Status => self.registers.sr().write(|w| w.bits(value)),
                Register::Control => self.registers.cr().write(|w| w.bits(value)),
            };
        }
        // Earlier writes complete, and later reads see memory that may have changed.
        cortex_m::asm::dsb();
    }

    fn memory(&self) -> &[Cell<u8>] {
        self.memory
    }

    fn program(&mut self, at: u32, word: u32) {
        let cells = self.memory.get(at as usize..).and_then(|cells| cells.first_chunk::<4>());
        if let Some(cells) = cells.filter(|cells| cells.as_ptr().cast::<u32>().is_aligned()) {
            // SAFETY: four cells of memory at a multiple of 4, which may change.
            unsafe { cells.as_ptr().cast_mut().cast::<u32>().write_volatile(word) };
        }
        cortex_m::asm::dsb();
    }

    fn is_driving(&self) -> bool {
        pwm::is_driving()
    }

    fn is_supplied(&self) -> bool {
        // A detector that is off reports nothing.
        self.power.cr().read().pvde().bit() && !self.power.csr().read().pvdo().bit()
    }

    fn with_watchdog_timeout<R>(&mut self, milliseconds: u16, work: impl FnOnce(&mut Self) -> R) -> Option<R> {
        watchdog::with_watchdog_timeout(milliseconds, self.khz, || work(self))
    }
}
