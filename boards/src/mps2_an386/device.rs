//! The registers of AN386 and AN500 (Arm DAI 0386C, section 3): UART 0, the watchdog, no power stage.

use core::cell::Cell;

pub use crate::cmsdk::{Uart, Watchdog};
pub use crate::mpu::guard_stack;
use crate::ram::Ram;
use crate::seams::{self, Cause, Clock, Source};
use crate::vectors::interrupts;

// Received bytes of UART 0; that for transmitted ones is another.
interrupts!(0 of 32);

/// Bits of an interrupt's priority.
pub const NVIC_PRIO_BITS: u8 = 3;
/// Words of scratch memory for a head.
pub const SCRATCH: usize = super::SCRATCH;
/// Whether a non-maskable interrupt says that the watchdog's time has ended, and that it will reset the board.
pub const WATCHDOG_NMI: bool = true;
/// Whether the flash may be written while the outputs are driven: it takes no time.
pub const FLASH_WHILE_ARMED: bool = true;

/// There is no power stage.
pub type Stage = crate::no_stage::NoStage<4200>;
/// Memory with the sectors and words of an STM32F405's flash.
pub type Flash = Ram<'static, 4, { 128 << 10 }>;

const HZ: u32 = 25_000_000;
const UART: usize = 0x4000_4000;
const WATCHDOG: usize = 0x4000_8000;

/// The board.
pub type Parts = seams::Parts<Uart, Watchdog, Stage>;

/// Sets the board up, with its serial port at `baud`.
///
/// # Safety
///
/// To be called once: all of the board's peripherals are the caller's.
pub unsafe fn start(baud: u32) -> Parts {
    // SAFETY: these are the addresses of DAI 0386C, and nobody else has the peripherals.
    let (uart, watchdog) = unsafe { (Uart::new(UART, HZ, baud), Watchdog::new(WATCHDOG, HZ)) };
    let clock = Clock { hz: HZ, source: Source::Crystal };
    Parts { clock, cause: Cause::Unknown, uart, watchdog, stage: Stage::default() }
}

/// All of `memory`.
///
/// # Safety
///
/// Nothing else changes it.
pub unsafe fn flash(memory: &'static [Cell<u8>]) -> Flash {
    Ram(memory)
}
