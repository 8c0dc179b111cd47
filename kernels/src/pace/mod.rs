//! A step in pieces: leave to go on ([`meter`]), where a step stands ([`cursor`]), what its pieces cost ([`cost`]) and what a poll
//! may spend ([`budget`]). The prices are here alone; a program whose steps are not cut has none of them.

pub(crate) mod budget;
pub mod cost;
pub(crate) mod cursor;
mod feature;
pub(crate) mod meter;
#[allow(clippy::approx_constant, reason = "measured values, some of which happen to be near a constant")]
mod rates;
