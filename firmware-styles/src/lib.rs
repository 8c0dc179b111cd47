//! What the three programs have in the place of an application: an image, sensors, motors, a timer.
//!
//! The sensors show the first observation of the image's self-test, and the motors write the first action that they get
//! to the host of QEMU, with the number of control ticks that the head has taken for it:
//! `host-tests/tests/all/on_target/styles.rs` compares.
#![cfg_attr(target_os = "none", no_std)]

#[cfg(target_os = "none")]
mod application;
#[cfg(target_os = "none")]
pub use application::*;

/// What the programs do where they are built for a host.
#[cfg(not(target_os = "none"))]
pub fn main() {
    eprintln!("this is firmware: build it with --target thumbv7em-none-eabihf");
    std::process::exit(1);
}
