//! Policies from files. An importer adds nodes to a [`crate::graph::Graph`], which checks that they fit, and fills in
//! the rest of a [`crate::policy::Policy`]; how its format names values is its own affair.

mod contract;
mod denoising;
mod folder;
mod json;
mod numbers;
pub mod onnx;
mod ops;
pub mod tensors;
pub mod values;

pub use folder::{FILES, folder_of, is_onnx};
