//! The decisions of a motor controller, without its peripherals: the firmware passes in bytes, ticks and times, and
//! writes the outputs.
//!
//! [`endpoint`] answers the link, [`guard`] checks observations for the head, and [`safety`] decides the outputs of
//! every tick. [`slots`] selects the image that runs, and [`scrub`] detects a changed one. [`progress`] decides when to
//! feed the watchdog, and [`breadcrumb`] reports the last crash. [`foc`] is a current loop for the control tick.
//! `docs/SAFETY.md` documents the states and the limits of these guarantees.
//!
//! This crate does not allocate, block or panic; each call's work is bounded.
#![no_std]
#![forbid(unsafe_code)]

mod age;
pub mod axis;
pub mod breadcrumb;
pub mod endpoint;
pub mod foc;
pub mod guard;
pub mod health;
pub mod limits;
mod parameters;
#[cfg(feature = "prefix")]
pub mod prefix;
pub mod progress;
mod requests;
pub mod safety;
pub mod scrub;
pub mod slots;
pub mod state;
pub mod update;

pub use axis::{Axis, Output, SafeAction};
pub use endpoint::Endpoint;
pub use guard::Guard;
pub use health::Check;
pub use limits::Limits;
pub use requests::Settings;
pub use safety::{Safety, Shared};
