//! The registers of the flash controller (RM0090, section 3.9), the supply's voltage (section 5.2.3), and what has to
//! hold while the processor stands still. In which order they are used is in `../flash.rs`. QEMU has none of them: they
//! read as 0 there.

use core::cell::Cell;

use stm32f4::stm32f405 as pac;

use super::{clock, pwm, watchdog};
use crate::stm32f405::flash::{Part, Register};

/// The detector's highest threshold, 2.9 V: with its spread still above the 2.7 V that a word needs.
const VOLTAGE: u8 = 0b111;

/// The flash controller, and the part of the flash that it writes.
#[derive(Debug)]
pub struct Controller {
    registers: pac::FLASH,
    power: pac::PWR,
    memory: &'static [Cell<u8>],
    /// Of the core.
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
            // It can only be written.
            Register::Key => 0,
            Register::Status => self.registers.sr().read().bits(),
            Register::Control => self.registers.cr().read().bits(),
        }
    }

    fn write(&mut self, register: Register, value: u32) {
        // SAFETY: any value is allowed; what the controller does with one is written memory of its sectors alone, of
        // which `../flash.rs` chooses those of `memory`, whose cells may change.
        unsafe {
            match register {
                Register::Access => self.registers.acr().write(|w| w.bits(value)),
                Register::Key => self.registers.keyr().write(|w| w.bits(value)),
                Register::Status => self.registers.sr().write(|w| w.bits(value)),
                Register::Control => self.registers.cr().write(|w| w.bits(value)),
            };
        }
        // What was written before is there, and the memory is read anew, as it may have changed.
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
        // A detector that is off sees nothing.
        self.power.cr().read().pvde().bit() && !self.power.csr().read().pvdo().bit()
    }

    fn patiently<R>(&mut self, milliseconds: u16, work: impl FnOnce(&mut Self) -> R) -> Option<R> {
        watchdog::patiently(milliseconds, self.khz, || work(self))
    }
}
