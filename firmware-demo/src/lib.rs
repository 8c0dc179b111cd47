//! The motor controller without a board: what its loop and its tick do with the decisions of `actq_controller`.
//! `bin/controller` puts it on one.
#![no_std]
#![forbid(unsafe_code)]

pub mod deadline;
#[cfg(feature = "faults")]
mod faults;
pub mod image;
#[cfg(feature = "foc")]
pub mod motor;
pub mod output;
pub mod patience;
pub mod running;
pub mod timing;
pub mod trace;
pub mod updates;
pub mod work;
