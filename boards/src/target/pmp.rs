//! The physical memory protection of RISC-V (privileged architecture, section 3.7): a guard region at the stack's lower
//! end without any access.

use core::ops::Range;

use riscv::register::{Permission, Range as Mode, pmpaddr0, pmpcfg0};

/// The guard's size in bytes, to which it is aligned. A larger stack frame could skip it.
pub const GUARD: u32 = 4096;

/// Guards the stack and returns the rest of it. A reset unlocks the guard.
///
/// # Safety
///
/// The stack pointer is far from the stack's end, and nothing else uses the protection's first entry.
pub unsafe fn guard_stack() -> Range<u32> {
    let memory = super::stack::memory();
    let guard = memory.start.next_multiple_of(GUARD);
    // SAFETY: nothing else uses this entry, as the caller promises; the region is aligned to its size, in stack memory
    // that is not in use. Only a locked entry holds in machine mode.
    unsafe {
        pmpaddr0::write((guard >> 2 | (GUARD / 8 - 1)) as usize);
        pmpcfg0::set_pmp(0, Mode::NAPOT, Permission::NONE, true);
    }
    guard + GUARD..memory.end
}
