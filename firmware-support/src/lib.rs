//! What the firmware binaries share: the processor's crates, the host's files through semihosting, the image slot, and the
//! marks between which instructions are counted.
#![no_std]
#![cfg(target_os = "none")]

pub mod count;
pub mod host;
pub mod machine;
pub mod slot;

use core::fmt::Write as _;
use core::panic::PanicInfo;

/// A fault of the firmware itself ends the run with a failure, and says where.
#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    if let Ok(mut out) = machine::semihosting::hio::hstderr() {
        let _ = writeln!(out, "{info}");
    }
    host::exit(false)
}

/// An exception ends the run with a failure, too, and says which and where; riscv-rt would loop.
#[cfg(target_arch = "riscv32")]
#[unsafe(export_name = "abort")]
extern "C" fn exception() -> ! {
    use riscv::register::{mcause, mepc};
    panic!("exception {} at {:#x}", mcause::read().code(), mepc::read())
}
