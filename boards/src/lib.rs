//! The boards that the firmware runs on. Each board, or family of boards, is a folder of this crate: its memory, the
//! host's description (`host.rs`: its emulation and the binaries that run on it), and, for the application, its
//! registers (`target`).
//!
//! On the host this crate is the table of boards for cargo's runner, build scripts, tests and measurements. On a target
//! it has the `device` of the board that a feature selects, the traits of [`hal`], and the shared serial port
//! ([`port`]).
#![cfg_attr(target_os = "none", no_std)]
#![cfg_attr(not(target_os = "none"), forbid(unsafe_code))]

// On both, so that the host tests them.
pub mod hal;
#[cfg(any(not(target_os = "none"), feature = "cmsdk", feature = "virt"))]
pub mod no_stage;
pub mod port;
pub mod ram;

// On the host.
#[cfg(not(target_os = "none"))]
mod board;
#[cfg(not(target_os = "none"))]
mod link;
#[cfg(not(target_os = "none"))]
mod table;

// On the target.
#[cfg(all(target_os = "none", feature = "device"))]
mod target;

// The boards.
#[cfg(not(target_os = "none"))]
mod microbit;
#[cfg(any(not(target_os = "none"), feature = "cmsdk"))]
mod mps2;
#[cfg(not(target_os = "none"))]
mod mps3;
#[cfg(any(not(target_os = "none"), feature = "stm32f405"))]
pub mod stm32f405;
#[cfg(not(target_os = "none"))]
mod v6m;
#[cfg(any(not(target_os = "none"), feature = "virt"))]
mod virt;

#[cfg(not(target_os = "none"))]
pub use board::{Application, Board};
#[cfg(not(target_os = "none"))]
pub use link::link;
#[cfg(all(target_os = "none", feature = "cmsdk"))]
pub use mps2::target as device;
#[cfg(all(target_os = "none", feature = "stm32f405"))]
pub use stm32f405::target as device;
#[cfg(not(target_os = "none"))]
pub use table::{Clock, Target, root, target_dir, version};
#[cfg(all(target_os = "none", feature = "virt"))]
pub use virt::target as device;
