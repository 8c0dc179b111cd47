//! Quantizes a robot policy to one image for a microcontroller.
//!
//! [`import`] reads a [`policy::Policy`] with its network, a [`graph::Graph`]; [`data`] reads the recordings.
//! [`pipeline`] makes an image of them. A method of [`methods`], or one of another crate ([`methods::CustomMethod`]),
//! turns every weight matrix into codes and scales, based on what [`calibrate`] finds in the recordings. [`emit`]
//! writes the bytes. [`measure`] runs the finished image through the same executor as the firmware.
#![deny(unsafe_code)]
#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

#[cfg(test)]
extern crate self as actq;

pub mod around;
pub mod budget;
pub mod calibrate;
pub mod contract;
pub mod data;
pub mod emit;
pub mod error;
mod gemm;
pub mod graph;
pub mod import;
pub mod measure;
pub mod methods;
pub mod numbers;
pub mod pipeline;
pub mod policy;
pub mod random;
pub mod runtime;
mod simd;
mod strict_json;
#[cfg(test)]
mod testing;
pub mod text;
pub mod units;
