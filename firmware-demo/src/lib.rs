//! The motor controller without a board: what its loop, its tick and its console do. `bin/controller` puts it on one.
#![no_std]
#![forbid(unsafe_code)]

pub mod application;
pub mod console;
pub mod off;
pub mod output;
pub mod text;
pub mod timing;
pub mod work;
