//! The fault handler of Armv6-M, which has one exception for all faults and no status. The stack is at the beginning of
//! RAM, so a stack overflow is a fault with the pointer at the stack's end or below it.

use core::arch::naked_asm;

use super::arm::{other, overflow};

/// Does nothing: the fault handler is always enabled.
pub(super) fn enable() {}

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
        "ldr  r1, 3f",
        "cmp  r0, r1",
        "bls  2f",
        "movs r1, #0",
        "bl   {other}",
        "2:",
        "ldr  r2, 4f",
        "msr  msp, r2",
        "bl   {overflown_at}",
        ".p2align 2",
        "3: .word _stack_end",
        "4: .word _stack_start",
        other = sym other,
        overflown_at = sym overflown_at,
    )
}

/// Handles a stack overflow: `pointer` is the stack's at the entry of the fault.
extern "C" fn overflown_at(pointer: u32) -> ! {
    // The frame of 8 words, most of which could not be stacked, has lowered the pointer.
    overflow(pointer.wrapping_add(8 * 4), false, 0)
}
