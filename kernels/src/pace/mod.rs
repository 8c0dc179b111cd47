//! The cost of operations and slices, and the budget of a poll. Only this module knows costs: code that runs an image
//! asks a `Meter` (`meter.rs`), and a program without slices does not include them.

pub(crate) mod budget;
pub mod cost;
mod feature;
#[allow(clippy::approx_constant, reason = "measured values, some of which happen to be near a constant")]
mod rates;
