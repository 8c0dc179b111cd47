//! From a policy and its recordings to an image: what the command calls, and whoever else wants images. Nothing here
//! prints or writes files.

mod budgets;
pub mod driven;
mod flash;
mod quantizer;
mod search;
pub mod stats;
pub mod sweep;
mod time;
mod tries;
pub mod tune;
mod unused;

pub use budgets::quantize;
pub use flash::check_budget;
pub use quantizer::{QuantizedPolicy, Quantizer};
pub use tries::{Search, Try};
pub use unused::{Reason, Unused};
