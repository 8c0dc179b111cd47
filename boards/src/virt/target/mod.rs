//! The registers of QEMU's virt (its `hw/riscv/virt.c` has the addresses): UART 0, the timer and the software interrupt of
//! its CLINT, its PLIC, the watchdog, no power stage.

mod clint;
mod uart;
mod watchdog;

use core::cell::Cell;

use riscv::interrupt::Interrupt;
use riscv::register::mie;
use volatile_register::RW;

pub use self::clint::Timer as Ticker;
pub use self::uart::Uart;
pub use self::watchdog::I6300esb as Watchdog;
use crate::hal::{self, Clock, Source};
use crate::ram::Ram;
pub use crate::target::pmp::{GUARD, guard_stack};

/// Scratch memory for a head, in words.
pub const SCRATCH: usize = super::SCRATCH;
/// `true` if a non-maskable interrupt announces the watchdog's reset; this one has none.
pub const WATCHDOG_NMI: bool = false;
/// `true` if the flash may be written while the outputs are driven; here writing takes no time.
pub const FLASH_WHILE_ARMED: bool = true;

/// The missing power stage.
pub type Stage = crate::no_stage::NoStage<4200>;
/// Memory with the sectors and words of an STM32F405's flash.
pub type Flash = Ram<'static, 4, { 128 << 10 }>;

/// The parts of the board.
pub type Parts = hal::Parts<Uart, Watchdog, Stage, Ticker>;

/// The PLIC: priority of the UART's interrupt, enabled interrupts of hart 0 in machine mode, its threshold and claim.
const PLIC: usize = 0x0c00_0000;
const UART_INTERRUPT: usize = 10;
const PRIORITY: usize = PLIC + 4 * UART_INTERRUPT;
const ENABLED: usize = PLIC + 0x2000;
const THRESHOLD: usize = PLIC + 0x20_0000;
const CLAIM: usize = THRESHOLD + 4;
/// The device that resets the machine, and the word that does.
const TEST: usize = 0x0010_0000;
const RESET: u32 = 0x7777;

/// Returns a register.
fn register<T: Copy>(address: usize) -> &'static RW<T> {
    // SAFETY: this module has only addresses of the machine's registers, which are volatile cells.
    unsafe { &*(address as *const RW<T>) }
}

/// Sets the board up, with its serial port at `baud`.
///
/// # Safety
///
/// Call it once: the caller owns all of the board's peripherals.
pub unsafe fn start(baud: u32) -> Parts {
    let uart = Uart::new(baud);
    let (watchdog, cause) = Watchdog::new();
    // SAFETY: the interrupts have handlers, and the core takes none before `enable_interrupts`.
    unsafe {
        register::<u32>(PRIORITY).write(1);
        register::<u32>(ENABLED).write(1 << UART_INTERRUPT);
        register::<u32>(THRESHOLD).write(0);
        mie::enable(Interrupt::MachineExternal);
        mie::enable(Interrupt::MachineSoft);
    }
    let clock = Clock { hz: clint::HZ, source: Source::Crystal };
    Parts { clock, cause, uart, watchdog, stage: Stage::default(), ticker: Ticker::default() }
}

/// Uses all of `memory`.
///
/// # Safety
///
/// Nothing else changes the memory.
pub unsafe fn flash(memory: &'static [Cell<u8>]) -> Flash {
    Ram(memory)
}

/// Handles the external interrupt, which is the UART's.
pub fn on_external_interrupt(handler: impl FnOnce()) {
    let claim = register::<u32>(CLAIM);
    let interrupt = claim.read();
    handler();
    // SAFETY: completes the claimed interrupt.
    unsafe { claim.write(interrupt) };
}

/// Handles the software interrupt of [`pend`].
pub fn on_software_interrupt(handler: impl FnOnce()) {
    clint::set_software_interrupt(false);
    handler();
}

/// Triggers the software interrupt.
pub fn pend() {
    clint::set_software_interrupt(true);
}

/// Resets the board.
pub fn reset() -> ! {
    loop {
        // SAFETY: the word resets the machine.
        unsafe { register::<u32>(TEST).write(RESET) };
    }
}
