//! The boards that the firmware runs on. Each board is a folder of this crate: its memory, its emulation, the binaries
//! that run on it, and, for the application, its registers.
//!
//! On the host this crate is the table of boards for cargo's runner, build scripts, tests and measurements. On a target
//! it is the `device` of the board that a feature selects, behind the traits of [`seams`], and the serial port that all
//! boards share ([`port`]).
#![cfg_attr(target_os = "none", no_std)]
#![cfg_attr(not(target_os = "none"), forbid(unsafe_code))]

#[cfg(any(not(target_os = "none"), feature = "cmsdk"))]
pub mod no_stage;
pub mod port;
pub mod ram;
pub mod seams;

#[cfg(not(target_os = "none"))]
mod board;
#[cfg(not(target_os = "none"))]
mod link;
#[cfg(not(target_os = "none"))]
mod microbit;
#[cfg(not(target_os = "none"))]
mod mps2_an385;
#[cfg(not(target_os = "none"))]
mod table;
#[cfg(not(target_os = "none"))]
mod virt;

#[cfg(all(target_os = "none", feature = "cmsdk"))]
mod cmsdk;
mod mps2_an386;
mod mps2_an500;
mod mps2_an505;
#[cfg(all(target_os = "none", any(feature = "mps2-an386", feature = "mps2-an500", feature = "stm32f405")))]
mod mpu;
#[cfg(all(target_os = "none", feature = "device"))]
mod stack;
#[cfg(any(not(target_os = "none"), feature = "stm32f405"))]
pub mod stm32f405;
#[cfg(all(target_os = "none", feature = "device"))]
mod vectors;

#[cfg(not(target_os = "none"))]
pub use board::{Application, Board};
#[cfg(not(target_os = "none"))]
pub use link::link;
#[cfg(all(target_os = "none", any(feature = "mps2-an386", feature = "mps2-an500")))]
pub use mps2_an386::device;
#[cfg(all(target_os = "none", feature = "mps2-an505"))]
pub use mps2_an505::device;
#[cfg(all(target_os = "none", feature = "stm32f405"))]
pub use stm32f405::device;
#[cfg(not(target_os = "none"))]
pub use table::{Clock, Target, root, target_dir, version};
