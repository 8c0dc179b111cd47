//! What the firmware binaries share: the host's files through semihosting, the image slot, the marks between which
//! instructions are counted, and how deep the stack gets.
#![no_std]
#![cfg(target_os = "none")]

pub mod count;
pub mod host;
pub mod slot;
pub mod stack;

use core::fmt::Write as _;
use core::panic::PanicInfo;

/// A fault of the firmware itself ends the run with a failure, and says where.
#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    if let Ok(mut out) = cortex_m_semihosting::hio::hstderr() {
        let _ = writeln!(out, "{info}");
    }
    host::exit(false)
}
