//! From a PyTorch policy to one flashable image: what the command `actq` is made of.
//!
//! [`policy::Policy`] reads `policy.json` and `policy.safetensors` into a [`graph::Graph`]; [`quantize`] turns every weight
//! matrix into codes and scales; [`lower`] places values in the arena, [`writer`] lays the bytes out and [`files`] puts them in
//! their place. [`eval`] and [`serve`] run the finished image through the same executor that the firmware runs.
#![deny(unsafe_code)]

pub mod backprop;
pub mod check;
pub mod dataset;
pub mod eval;
pub mod files;
pub mod graph;
pub mod inspect;
mod json;
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
mod tensor_file;
pub mod text;
pub mod time;
pub mod unrounded;
pub mod widths;
pub mod writer;

/// The versions that take part in making an image; recorded in reports.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
