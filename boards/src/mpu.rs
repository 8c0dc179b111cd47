//! The memory protection unit of Armv7-M (Arm DDI 0403E, section B3.5): a guard at the stack's lower end, which nothing
//! may touch.

use core::ops::Range;

use cortex_m::asm;
use cortex_m::peripheral::MPU;

/// log2 of the guard's bytes, of which it begins at a multiple. A frame that is larger may leap over it;
/// `host-tests/tests/all/on_target/application.rs` holds all frames below.
const SIZE_LOG2: u32 = 12;

/// Region 0 and a base address, in one write.
const VALID_REGION_0: u32 = 1 << 4;
/// No access, no execution; the memory's type does not matter.
const NO_ACCESS: u32 = 1 << 28;
const ENABLE: u32 = 1;
/// Everything else is as without the unit.
const DEFAULT_MAP: u32 = 1 << 2;

/// Guards the stack, and gives what is left of it. A fault handler runs with the guard up; HardFault and NMI run
/// without it.
///
/// # Safety
///
/// The stack is nowhere near its end, and nothing else uses the unit.
pub unsafe fn guard_stack() -> Range<u32> {
    let memory = crate::stack::memory();
    let guard = memory.start.next_multiple_of(1 << SIZE_LOG2);
    // SAFETY: the unit's registers, which nothing else writes, as the caller promises; the region begins at a multiple
    // of its size, and is memory of the stack that is not in use.
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
