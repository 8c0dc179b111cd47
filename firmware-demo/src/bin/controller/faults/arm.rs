//! The faults of all Cortex-M: the exception frame, a stack overflow, the non-maskable interrupt.

use core::arch::naked_asm;
use core::sync::atomic::Ordering;

use actq_boards::device::WATCHDOG_NMI;
use actq_firmware_demo::trace::program_counter;
use actq_link::code::Crash;
use cortex_m::peripheral::SCB;
use cortex_m_rt::ExceptionFrame;

use super::{BOTTOM, MISSING, TOP, end, leave_record};

/// Resets the board.
pub(super) fn reset() -> ! {
    SCB::sys_reset()
}

/// Leaves the record of a fault that is no stack overflow; `status` is the core's, or 0.
pub(super) extern "C" fn other(frame: &ExceptionFrame, status: u32) -> ! {
    end(Crash::HardFault, frame.pc(), status)
}

/// Leaves the record of a stack overflow. `from` is the lowest word of the stack that may be in use: the exception frame
/// if it `is_stacked`, else what earlier calls left there, with return addresses of theirs.
pub(super) fn overflow(from: u32, is_stacked: bool, status: u32) -> ! {
    unsafe extern "C" {
        static __stext: u16;
        static __etext: u16;
    }
    let code = (&raw const __stext) as u32..(&raw const __etext) as u32;
    let half = |address: u32| {
        // SAFETY: an even address within the code.
        code.contains(&address).then(|| unsafe { (address as *const u16).read() })
    };
    let [bottom, top] = [&BOTTOM, &TOP].map(|address| address.load(Ordering::Relaxed));
    let words = (from.max(bottom)..top).step_by(4);
    // SAFETY: readable words of the stack: its pointer and its ends are multiples of 4.
    let words = words.map(|address| unsafe { (address as *const u32).read_volatile() });
    end(Crash::StackOverflow, program_counter(words, is_stacked, half).unwrap_or(0), status)
}

/// Handles the non-maskable interrupt, for boards that use it: passes the exception frame on.
///
/// # Safety
///
/// Only for the vector table.
#[unsafe(naked)]
#[unsafe(no_mangle)]
unsafe extern "C" fn NonMaskableInt() {
    // BL, which reaches farther than B on Armv6-M; nothing returns.
    naked_asm!("mrs r0, msp", "bl {then}", then = sym non_maskable)
}

extern "C" fn non_maskable(frame: &ExceptionFrame) -> ! {
    if WATCHDOG_NMI {
        leave_record(Crash::Watchdog, frame.pc(), MISSING.load(Ordering::Relaxed));
        // Wait for the watchdog's reset.
        loop {
            cortex_m::asm::nop();
        }
    }
    end(Crash::HardFault, frame.pc(), 0)
}
