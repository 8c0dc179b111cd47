//! A stack at the beginning of RAM, for cores without a protection unit: no memory is below it, so an overflow is a fault.

use core::ops::Range;

/// Returns the stack's addresses. Its place is the guard.
///
/// # Safety
///
/// None; the guards of other cores have conditions.
pub unsafe fn guard_stack() -> Range<u32> {
    super::stack::memory()
}
