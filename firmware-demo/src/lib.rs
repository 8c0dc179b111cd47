//! The motor controller without a board: its loop and its tick, on top of the decisions of `actq_controller`.
//! `bin/controller` runs it on a board.
#![no_std]
#![forbid(unsafe_code)]

pub mod deadline;
#[cfg(feature = "faults")]
mod faults;
pub mod image;
#[cfg(feature = "foc")]
pub mod motor;
pub mod output;
pub mod running;
pub mod timeouts;
pub mod timing;
pub mod trace;
pub mod updates;
pub mod work;
