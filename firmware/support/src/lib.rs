//! Shared code of the firmware binaries: the processor's crates, the host's files through semihosting, the image slot,
//! the marks of counted regions, and memory that a reset preserves.
#![no_std]
#![cfg(target_os = "none")]

pub mod count;
pub mod host;
pub mod kept;
pub mod machine;
pub mod slot;
pub mod stack;

use core::fmt::Write as _;
use core::panic::PanicInfo;

/// Handles a panic in firmware with a host: prints its message and location, and ends the run with a failure.
/// [`panic_to_host`] declares it as the handler.
pub fn panicked(info: &PanicInfo<'_>) -> ! {
    if let Some(mut err) = host::stderr() {
        let _ = writeln!(err, "{info}");
    }
    host::exit(false)
}

/// Declares [`panicked`] as the panic handler, and that an exception of RISC-V is a panic.
#[macro_export]
macro_rules! panic_to_host {
    () => {
        #[panic_handler]
        fn panic(info: &core::panic::PanicInfo<'_>) -> ! {
            $crate::panicked(info)
        }

        // riscv-rt would loop.
        #[cfg(target_arch = "riscv32")]
        #[unsafe(export_name = "abort")]
        extern "C" fn abort() -> ! {
            $crate::exception()
        }
    };
}

/// Handles an exception as a panic with its code and address.
#[cfg(target_arch = "riscv32")]
pub fn exception() -> ! {
    use riscv::register::{mcause, mepc};
    panic!("exception {} at {:#x}", mcause::read().code(), mepc::read())
}
