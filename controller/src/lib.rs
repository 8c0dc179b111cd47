//! What a motor controller decides, without its peripherals: the firmware feeds bytes, ticks and times, and writes the
//! outputs.
//!
//! [`endpoint`] answers the link, [`guard`] lets observations to the head, [`safety`] decides every tick what the
//! outputs do, [`slots`] which image runs, [`progress`] when the watchdog is fed, [`scrub`] notices that the image has
//! changed, and [`breadcrumb`] says what the last run died of. [`foc`] is a current loop for the control tick.
//! `docs/SAFETY.md` has the states, and what is not claimed.
//!
//! Nothing here allocates, blocks or panics; each call's work is bounded.
#![no_std]
#![forbid(unsafe_code)]

// Which of these may use which: the table in docs/ARCHITECTURE.md, which a test reads.
mod age;
pub mod axis;
pub mod breadcrumb;
pub mod endpoint;
pub mod foc;
pub mod guard;
pub mod health;
pub mod limits;
mod parameters;
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
