//! The tests that take more than one crate: one binary, so that one is linked and what they build is built once.

mod application;
mod arrows;
mod best;
mod cli;
mod compare;
mod controller;
mod cost;
mod counting;
mod denoising;
mod digests;
mod drive;
mod faults;
mod format;
mod functions;
mod malformed;
mod memory;
mod ops;
mod outputs;
mod parity;
mod playback;
mod portable;
mod qemu;
mod recorded;
mod recordings;
mod slices;
mod stats;
