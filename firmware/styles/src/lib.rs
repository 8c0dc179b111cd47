//! Shared stand-ins of the three programs for an application: an image, sensors, motors, a timer.
//!
//! The sensors provide the first observation of the image's self-test. The motors write the first action to QEMU's
//! host, with the number of control ticks that the head took for it. `host-tests/tests/all/on_target/styles.rs`
//! compares both.
#![cfg_attr(target_os = "none", no_std)]

#[cfg(target_os = "none")]
mod application;
#[cfg(target_os = "none")]
pub use application::*;

/// Exits with a note when the programs are built for a host.
#[cfg(not(target_os = "none"))]
pub fn main() {
    eprintln!("this is firmware: build it with --target thumbv7em-none-eabihf");
    std::process::exit(1);
}
