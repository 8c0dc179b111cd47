//! The exceptions of RISC-V: each ends the program. Interrupts go on to riscv-rt.

use core::arch::naked_asm;
use core::sync::atomic::Ordering;

use actq_boards::device;
use actq_link::code::Crash;
use riscv::register::{mcause, mepc, mtval};

use super::{BOTTOM, end};

pub(super) use actq_boards::device::reset;

/// Does nothing: exceptions are always enabled.
pub(super) fn enable() {}

/// Handles traps. An exception first resets the stack pointer to the stack's start: the stack may have overflowed.
///
/// # Safety
///
/// Only for the trap vector.
#[unsafe(naked)]
#[unsafe(no_mangle)]
#[unsafe(link_section = ".trap.start")]
unsafe extern "C" fn _start_trap() {
    naked_asm!(
        ".p2align 2",
        "csrw mscratch, t0",
        "csrr t0, mcause",
        "bgez t0, 2f",
        "csrr t0, mscratch",
        "j    _default_start_trap",
        "2:",
        "la   sp, _stack_start",
        "j    {exception}",
        exception = sym exception,
    )
}

extern "C" fn exception() -> ! {
    // The address of the access, in an exception by one.
    let (bottom, address) = (BOTTOM.load(Ordering::Relaxed), mtval::read() as u32);
    let is_guard = (bottom.wrapping_sub(device::GUARD)..bottom).contains(&address);
    let crash = if is_guard { Crash::StackOverflow } else { Crash::HardFault };
    end(crash, mepc::read() as u32, mcause::read().code() as u32)
}
