//! Makes an image from a policy and its recordings: the interface for the command and other programs. Nothing here
//! prints or writes files.

mod budgets;
pub mod driven;
mod flash;
mod held_out;
mod quantizer;
mod revision;
mod search;
pub mod stats;
mod time;
mod tries;
pub mod tune;
mod unused;
mod watch;

pub use budgets::quantize;
pub use flash::check_budget;
pub use held_out::{HeldOut, minutes_of_image};
pub use quantizer::{QuantizedPolicy, Quantizer};
pub use revision::REVISION;
pub use tries::{Search, Try};
pub use unused::{Reason, Unused};
pub use watch::Watch;
