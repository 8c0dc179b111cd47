//! The stack limit register of Armv8-M.

use core::ops::Range;

use cortex_m::register::msplim;

/// Limits the stack and returns its addresses.
///
/// # Safety
///
/// The stack pointer is far from the stack's end.
pub unsafe fn guard_stack() -> Range<u32> {
    let memory = super::stack::memory();
    // The register has no lower bits.
    let limit = memory.start.next_multiple_of(8);
    // SAFETY: after all variables, and below the stack pointer, as the caller promises.
    unsafe { msplim::write(limit) };
    limit..memory.end
}
