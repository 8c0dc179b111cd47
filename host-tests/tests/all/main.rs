//! The tests that take more than one crate: one binary, so that one is linked and what they build is built once.

mod accuracy;
mod arrows;
mod best;
mod budgets;
mod cli;
mod compare;
mod constants;
mod controller;
mod denoising;
mod digests;
mod drive;
mod faults;
mod flow;
mod format;
mod malformed;
mod memory;
mod on_target;
mod ops;
mod outputs;
mod parity;
mod playback;
mod recorded;
mod recordings;
mod slices;
mod smoke;
mod stats;
