//! What operations and pieces of a step cost, and what a poll may spend. The prices are here alone: what runs an image
//! asks a `Meter` (`meter.rs`), and a program whose steps are not cut has none of them.

pub(crate) mod budget;
pub mod cost;
mod feature;
#[allow(clippy::approx_constant, reason = "measured values, some of which happen to be near a constant")]
mod rates;
