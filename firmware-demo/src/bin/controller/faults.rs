//! What ends the program: each leaves a crumb, which the next start tells, and resets.

use core::arch::naked_asm;
use core::panic::PanicInfo;

use actq_firmware_support::crumb::{self, Kind};
use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, exception};

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    crumb::leave(Kind::Panic, info.location().map_or(0, |location| location.line()), 0);
    SCB::sys_reset()
}

#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    crumb::leave(Kind::HardFault, frame.pc(), frame.lr());
    SCB::sys_reset()
}

/// The non-maskable interrupt, where a board has a reason for it: it passes what the core has stacked on.
///
/// # Safety
///
/// For the vector table alone.
#[unsafe(naked)]
#[unsafe(no_mangle)]
unsafe extern "C" fn NonMaskableInt() {
    naked_asm!("mrs r0, msp", "b {then}", then = sym non_maskable)
}

/// Waits for the reset that the watchdog makes.
extern "C" fn non_maskable(frame: &ExceptionFrame) -> ! {
    crumb::leave(Kind::Nmi, frame.pc(), frame.lr());
    loop {
        cortex_m::asm::nop();
    }
}
