//! The stack's memory, from the linker script.

use core::ops::Range;

/// Returns the addresses from the stack's end to its start.
pub(crate) fn memory() -> Range<u32> {
    unsafe extern "C" {
        static _stack_end: u32;
        static _stack_start: u32;
    }
    (&raw const _stack_end) as u32..(&raw const _stack_start) as u32
}
