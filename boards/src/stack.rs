//! Where the linker's script puts the stack.

use core::ops::Range;

/// The addresses behind all variables, up to the stack's begin.
pub(crate) fn memory() -> Range<u32> {
    unsafe extern "C" {
        static _stack_end: u32;
        static _stack_start: u32;
    }
    (&raw const _stack_end) as u32..(&raw const _stack_start) as u32
}
