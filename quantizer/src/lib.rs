//! From a PyTorch policy to one flashable image: what the command `actq` is made of.
//!
//! [`import`] reads a [`policy::Policy`] with its network, a [`graph::Graph`], and [`data`] the recorded observations.
//! [`pipeline`] makes an image of them: a method of [`methods`] turns every weight matrix into codes and scales, from
//! what [`calibrate`] finds in the recordings, and [`emit`] lays the bytes out. [`measure`] and [`serve`] run the
//! finished image through the same executor that the firmware runs; [`report`] says it to people.
//!
//! Which folder may use which is written in `docs/ARCHITECTURE.md`, and tested.
#![deny(unsafe_code)]

pub mod budget;
pub mod calibrate;
pub mod contract;
pub mod data;
pub mod emit;
pub mod graph;
pub mod import;
pub mod measure;
pub mod methods;
pub mod pipeline;
pub mod policy;
pub mod random;
pub mod report;
pub mod runtime;
pub mod serve;
mod strict_json;
pub mod text;
