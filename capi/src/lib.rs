//! C interface of the executor. `include/actq.h` is made from it by cbindgen; a test compares them.
//!
//! Each function takes the caller's pointers, checks them (`memory.rs`), and calls `actq-kernels`. It returns the
//! number of a [`Code`]: 0, or the number of the kernels' error.
//!
//! # Safety
//!
//! The same for every function: a pointer is null, or valid for the length that goes with it (a string ends in a zero);
//! an opened image's bytes and an initialized head's scratch memory stay their own; and nothing else uses a head or a
//! buffer during a call. Everything else is checked.
#![cfg_attr(feature = "panic-handler", no_std)]
// Above, once for all.
#![allow(clippy::missing_safety_doc)]

mod head;
mod image;
mod memory;
mod status;

pub use head::*;
pub use image::*;
pub use status::*;

/// Number of this interface: it changes with every change of a structure or a function.
pub const ACTQ_ABI: u32 = 3;

/// Bytes of stack that a call takes at most on a Cortex-M with the assembler kernels, without interrupts. A test
/// computes them from the calls in a linked program, for any image.
pub const ACTQ_STACK_BYTES: usize = 2560;

/// Returns the library's `ACTQ_ABI`. A program that was compiled with another header must not go on.
#[unsafe(no_mangle)]
pub extern "C" fn actq_abi() -> u32 {
    ACTQ_ABI
}

// In the library for microcontrollers only: a host has its own.
#[cfg(all(target_arch = "arm", feature = "panic-handler"))]
core::arch::global_asm!(include_str!("memory.s"), options(raw));

/// The kernels do not panic after an image's check, and nothing here does: this is never called, and stops the program
/// if it is.
#[cfg(feature = "panic-handler")]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {
        core::hint::spin_loop();
    }
}
