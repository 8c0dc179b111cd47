//! The fault handlers of Armv7-M and Armv8-M, which have a fault status and a guard below the stack.

use core::arch::naked_asm;
use core::sync::atomic::Ordering;

use cortex_m::Peripherals;
use cortex_m::peripheral::scb::Exception;

use super::BOTTOM;
use super::arm::{other, overflow};

/// Address of the configurable fault status register.
const CFSR: u32 = 0xe000_ed28;
/// Its bits for a stack overflow. STACKING: the core could not stack. ACCESS: the program touched the guard, the only
/// memory that the memory protection unit forbids. LIMIT: the pointer would have passed its limit (Armv8-M).
const STACKING: u32 = 1 << 4;
const ACCESS: u32 = 1 << 1;
const LIMIT: u32 = 1 << 20;
/// Bit of EXC_RETURN that is 1 if the exception frame has no floating-point registers: 8 words instead of 26.
const BASIC_FRAME: u32 = 1 << 4;

/// Enables the faults of the guard and of the stack limit.
pub(super) fn enable() {
    // SAFETY: the start has no interrupts yet, and nothing else changes this register.
    let mut scb = unsafe { Peripherals::steal() }.SCB;
    scb.enable(Exception::MemoryManagement);
    scb.enable(Exception::UsageFault);
}

/// Handles faults. After a stack overflow it first resets the stack pointer to the stack's start. It passes on the
/// exception frame, or its place if the core could not stack it.
///
/// # Safety
///
/// Only for the vector table.
#[unsafe(naked)]
#[unsafe(no_mangle)]
unsafe extern "C" fn HardFault() {
    naked_asm!(
        "mrs  r0, msp",
        "movw r1, #:lower16:{status}",
        "movt r1, #:upper16:{status}",
        "ldr  r1, [r1]",
        "movw r2, #:lower16:{overflown}",
        "movt r2, #:upper16:{overflown}",
        "tst  r1, r2",
        "beq  {other}",
        "movw r2, #:lower16:_stack_start",
        "movt r2, #:upper16:_stack_start",
        "msr  msp, r2",
        "mov  r2, lr",
        "b    {overflown_at}",
        status = const CFSR,
        overflown = const STACKING | ACCESS | LIMIT,
        other = sym other,
        overflown_at = sym overflown_at,
    )
}

/// Handles faults of the memory protection unit: [`HardFault`] distinguishes them.
///
/// # Safety
///
/// Only for the vector table.
#[unsafe(naked)]
#[unsafe(no_mangle)]
unsafe extern "C" fn MemoryManagement() {
    naked_asm!("b {fault}", fault = sym HardFault)
}

/// Handles usage faults, such as the stack limit's, as [`MemoryManagement`] does.
///
/// # Safety
///
/// Only for the vector table.
#[unsafe(naked)]
#[unsafe(no_mangle)]
unsafe extern "C" fn UsageFault() {
    naked_asm!("b {fault}", fault = sym HardFault)
}

/// Handles a stack overflow: `pointer` is the stack's at the entry of the fault, and `exc_return` the link register.
extern "C" fn overflown_at(pointer: u32, status: u32, exc_return: u32) -> ! {
    // A frame that could not be stacked lowers the pointer all the same (Arm DDI 0403E, B1.5.6, PushStack).
    let frame = if exc_return & BASIC_FRAME == 0 { 26 * 4 } else { 8 * 4 };
    let lowered = if status & STACKING == 0 { 0 } else { frame };
    // If the core could not stack, Armv7-M sets a bit, and Armv8-M leaves the pointer at the limit.
    let is_stacked = status & STACKING == 0 && pointer > BOTTOM.load(Ordering::Relaxed);
    overflow(pointer.wrapping_add(lowered), is_stacked, status)
}
