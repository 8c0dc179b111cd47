//! The registers of AN505 (Arm DAI 0505B, section 3) in the secure state, whose addresses have bit 28 set: UART 0, the
//! secure watchdog, no power stage.

use core::cell::Cell;
use core::ops::Range;

use cortex_m::register::msplim;

pub use crate::cmsdk::{Uart, Watchdog};
use crate::ram::Ram;
use crate::seams::{self, Cause, Clock, Source};
use crate::vectors::interrupts;

// UART 0, whatever has happened.
interrupts!(42 of 96);

/// Bits of an interrupt's priority.
pub const NVIC_PRIO_BITS: u8 = 3;
/// Words of scratch memory for a head.
pub const SCRATCH: usize = crate::mps2_an386::SCRATCH;
/// Whether a non-maskable interrupt says that the watchdog's time has ended, and that it will reset the board.
pub const WATCHDOG_NMI: bool = true;
/// Whether the flash may be written while the outputs are driven: it takes no time.
pub const FLASH_WHILE_ARMED: bool = true;

/// There is no power stage.
pub type Stage = crate::no_stage::NoStage<4200>;
/// Memory with the sectors and words of an STM32F405's flash.
pub type Flash = Ram<'static, 4, { 128 << 10 }>;

const HZ: u32 = 20_000_000;
const UART: usize = 0x5020_0000;
const WATCHDOG: usize = 0x5008_1000;

/// The board.
pub type Parts = seams::Parts<Uart, Watchdog, Stage>;

/// Sets the board up, with its serial port at `baud`.
///
/// # Safety
///
/// To be called once: all of the board's peripherals are the caller's.
pub unsafe fn start(baud: u32) -> Parts {
    // SAFETY: these are the addresses of DAI 0505B, and nobody else has the peripherals.
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

/// Limits the stack (Armv8-M has a register for it), and gives where it is.
///
/// # Safety
///
/// The stack is nowhere near its end.
pub unsafe fn guard_stack() -> Range<u32> {
    let memory = crate::stack::memory();
    // The register has no lower bits.
    let limit = memory.start.next_multiple_of(8);
    // SAFETY: behind all variables, and below the stack pointer, as the caller promises.
    unsafe { msplim::write(limit) };
    limit..memory.end
}
