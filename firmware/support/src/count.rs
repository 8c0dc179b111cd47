//! Marks for the instruction counter (`tools/xtask/insn-count`): it counts the instructions between a call of
//! [`actq_count_begin`] and the next call of [`actq_count_end`].

use crate::machine::asm;

/// Starts a region.
#[unsafe(no_mangle)]
#[inline(never)]
pub extern "C" fn actq_count_begin() {
    // An instruction that the compiler must keep, so that the call is not removed.
    asm::nop();
}

/// Ends a region.
#[unsafe(no_mangle)]
#[inline(never)]
pub extern "C" fn actq_count_end() {
    // One more than in `actq_count_begin`, because the compiler merges equal functions.
    asm::nop();
    asm::nop();
}

/// Runs `work` as a counted region.
#[inline(always)]
pub fn region<T>(work: impl FnOnce() -> T) -> T {
    actq_count_begin();
    let result = work();
    actq_count_end();
    result
}
