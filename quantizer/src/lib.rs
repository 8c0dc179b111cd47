//! From a PyTorch policy to one flashable image: what the command `actq` is made of.
//!
//! [`policy::Policy`] reads `policy.json` and `policy.safetensors` into a [`graph::Graph`]. [`pipeline`] makes an image of it: a
//! method of [`methods`] turns every weight matrix into codes and scales, from what [`calibrate`] finds in the recorded
//! observations, [`lower`] places values in the arena, [`writer`] lays the bytes out and [`files`] puts them in their place.
//! [`measure`] and [`serve`] run the finished image through the same executor that the firmware runs; [`report`] says it to people.
//!
//! Which folder may use which is written in `docs/ARCHITECTURE.md`, and tested.
#![deny(unsafe_code)]

pub mod budget;
pub mod calibrate;
pub mod dataset;
pub mod files;
pub mod graph;
mod json;
pub mod lower;
pub mod measure;
pub mod methods;
pub mod pipeline;
pub mod policy;
pub mod random;
pub mod report;
pub mod runtime;
pub mod serve;
mod tensor_file;
pub mod text;
pub mod writer;
