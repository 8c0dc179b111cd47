//! The registers of the MPS2 and MPS3 boards: UART 0, the watchdog, no power stage. AN385, AN386 and AN500 share their
//! addresses (Arm DAI 0386C, section 3). AN505 (Arm DAI 0505B, section 3) and AN547 (Arm DAI 0547B, section 3) have those
//! of the secure state, with bit 28 set.

use core::cell::Cell;

use crate::hal::{self, Cause, Clock, Source};
use crate::ram::Ram;
pub use crate::target::cmsdk::{Uart, Watchdog};
#[cfg(feature = "armv6m")]
pub use crate::target::lowest::guard_stack;
#[cfg(not(any(feature = "armv6m", feature = "armv8m")))]
pub use crate::target::mpu::guard_stack;
#[cfg(feature = "armv8m")]
pub use crate::target::msplim::guard_stack;
pub use crate::target::systick::SysTick as Ticker;
use crate::target::vectors::interrupts;

/// Clocks and addresses of AN385, AN386 and AN500.
#[cfg(not(feature = "armv8m"))]
mod map {
    pub(super) const HZ: u32 = 25_000_000;
    pub(super) const UART: (usize, u32) = (0x4000_4000, HZ);
    pub(super) const WATCHDOG: (usize, u32) = (0x4000_8000, HZ);
}

/// Clocks and addresses of AN505.
#[cfg(feature = "mps2-an505")]
mod map {
    pub(super) const HZ: u32 = 20_000_000;
    pub(super) const UART: (usize, u32) = (0x5020_0000, HZ);
    pub(super) const WATCHDOG: (usize, u32) = (0x5008_1000, HZ);
}

/// Clocks and addresses of AN547: its watchdog has the slow clock.
#[cfg(feature = "mps3-an547")]
mod map {
    pub(super) const HZ: u32 = 32_000_000;
    pub(super) const UART: (usize, u32) = (0x5930_3000, 25_000_000);
    pub(super) const WATCHDOG: (usize, u32) = (0x5802_e000, 32_000);
}

// Received bytes of UART 0; transmitted ones have another interrupt.
#[cfg(not(feature = "armv8m"))]
interrupts!(0 of 32);
// All events of UART 0.
#[cfg(feature = "mps2-an505")]
interrupts!(42 of 96);
#[cfg(feature = "mps3-an547")]
interrupts!(43 of 96);

/// Number of bits of an interrupt's priority.
pub const NVIC_PRIO_BITS: u8 = if cfg!(feature = "armv6m") { 2 } else { 3 };
/// Scratch memory for a head, in words.
pub const SCRATCH: usize = super::SCRATCH;
/// `true` if a non-maskable interrupt announces the watchdog's reset.
pub const WATCHDOG_NMI: bool = true;
/// `true` if the flash may be written while the outputs are driven; here writing takes no time.
pub const FLASH_WHILE_ARMED: bool = true;

/// The missing power stage.
pub type Stage = crate::no_stage::NoStage<4200>;
/// Memory with the sectors and words of an STM32F405's flash.
pub type Flash = Ram<'static, 4, { 128 << 10 }>;

/// The parts of the board.
pub type Parts = hal::Parts<Uart, Watchdog, Stage, Ticker>;

/// Sets the board up, with its serial port at `baud`.
///
/// # Safety
///
/// Call it once: the caller owns all of the board's peripherals.
pub unsafe fn start(baud: u32) -> Parts {
    // SAFETY: these are the documented addresses, and nothing else uses the peripherals.
    let (uart, watchdog, ticker) = unsafe {
        (Uart::new(map::UART.0, map::UART.1, baud), Watchdog::new(map::WATCHDOG.0, map::WATCHDOG.1), Ticker::new())
    };
    let clock = Clock { hz: map::HZ, source: Source::Crystal };
    Parts { clock, cause: Cause::Unknown, uart, watchdog, stage: Stage::default(), ticker }
}

/// Uses all of `memory`.
///
/// # Safety
///
/// Nothing else changes the memory.
pub unsafe fn flash(memory: &'static [Cell<u8>]) -> Flash {
    Ram(memory)
}
