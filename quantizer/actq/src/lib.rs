//! Quantizes a robot policy to one image for a microcontroller.
//!
//! [`import`] reads a [`policy::Policy`] with its network, a [`graph::Graph`], and [`data`] the recorded observations.
//! [`pipeline`] makes an image of them: a method of [`methods`] turns every weight matrix into codes and scales, from
//! what [`calibrate`] finds in the recordings, and [`emit`] lays the bytes out. [`measure`] runs the
//! finished image through the same executor that the firmware runs.
//!
//! Which folder may use which is written in `docs/ARCHITECTURE.md`, and tested.
#![deny(unsafe_code)]

pub mod budget;
pub mod calibrate;
pub mod contract;
pub mod data;
pub mod emit;
pub mod error;
pub mod graph;
pub mod import;
pub mod measure;
pub mod methods;
pub mod pipeline;
pub mod policy;
pub mod random;
pub mod runtime;
mod strict_json;
pub mod text;
