//! From a PyTorch policy to one flashable image: what the command `actq` is made of.
//!
//! [`policy::Policy`] reads `policy.json` and `policy.safetensors` into a [`graph::Graph`]; [`quantize`] turns every weight
//! matrix into codes and scales; [`lower`] places values in the arena and [`writer`] lays the bytes out. [`eval`] and [`serve`]
//! run the finished image through the same executor that the firmware runs.
#![deny(unsafe_code)]

pub mod budget;
pub mod calibrate;
pub mod dataset;
pub mod graph;
pub mod lower;
pub mod measure;
pub mod methods;
pub mod pipeline;
pub mod policy;
pub mod random;
pub mod report;
pub mod runtime;
pub mod serve;
pub mod writer;

/// The versions that take part in making an image; recorded in reports.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
