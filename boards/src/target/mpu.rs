//! The memory protection unit of Armv7-M (Arm DDI 0403E, section B3.5): a guard region at the stack's lower end without
//! any access.

use core::ops::Range;

use cortex_m::asm;
use cortex_m::peripheral::MPU;

/// log2 of the guard's size in bytes, to which it is aligned. A larger stack frame could skip it;
/// `host-tests/tests/all/on_target/application.rs` asserts that all frames are smaller.
const SIZE_LOG2: u32 = 12;

/// Region 0 and a base address, in one write.
const VALID_REGION_0: u32 = 1 << 4;
/// No access and no execution; the memory type does not matter.
const NO_ACCESS: u32 = 1 << 28;
const ENABLE: u32 = 1;
/// All other memory is as without the unit.
const DEFAULT_MAP: u32 = 1 << 2;

/// Guards the stack and returns the rest of it. The guard is active in fault handlers, except HardFault and NMI.
///
/// # Safety
///
/// The stack pointer is far from the stack's end, and nothing else uses the unit.
pub unsafe fn guard_stack() -> Range<u32> {
    let memory = super::stack::memory();
    let guard = memory.start.next_multiple_of(1 << SIZE_LOG2);
    // SAFETY: nothing else writes the unit's registers, as the caller promises; the region is aligned to its size, in
    // stack memory that is not in use.
    unsafe {
        let mpu = &*MPU::PTR;
        mpu.rbar.write(guard | VALID_REGION_0);
        mpu.rasr.write(NO_ACCESS | (SIZE_LOG2 - 1) << 1 | ENABLE);
        asm::dmb();
        mpu.ctrl.write(DEFAULT_MAP | ENABLE);
    }
    asm::dsb();
    asm::isb();
    guard + (1 << SIZE_LOG2)..memory.end
}
