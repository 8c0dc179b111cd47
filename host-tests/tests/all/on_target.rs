//! The tests that build firmware and run it under QEMU, or read its ELF file. `cargo verify --all` runs them, and
//! `cargo verify` runs only those of [`crate::smoke`].

pub(crate) mod application;
mod attention;
mod c;
mod checksums;
mod compact;
mod cost;
mod counting;
mod denoising;
mod deployed;
mod firmware;
mod foc;
mod functions;
mod heads;
mod link;
mod linked;
mod logs;
mod packages;
mod portable;
mod prefix;
pub(crate) mod qemu;
mod repacked;
mod start;
mod styles;
