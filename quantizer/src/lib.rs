//! From a PyTorch policy to one flashable image: what the command `actq` is made of.
//!
//! [`policy::Policy`] reads `policy.json` and `policy.safetensors` into a [`graph::Graph`]; [`quantize`] turns every weight
//! matrix into codes and scales; [`lower`] places values in the arena and [`writer`] lays the bytes out. [`eval`] and [`serve`]
//! run the finished image through the same executor that the firmware runs.
#![deny(unsafe_code)]

pub mod check;
pub mod dataset;
pub mod eval;
pub mod graph;
pub mod inspect;
pub mod lower;
pub mod plot;
pub mod policy;
pub mod quantize;
pub mod random;
pub mod runtime;
pub mod search;
pub mod serve;
pub mod stats;
pub mod sweep;
pub mod time;
pub mod unrounded;
pub mod widths;
pub mod writer;

/// The versions that take part in making an image; recorded in reports.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
