//! Policies from files. An importer adds nodes to a [`crate::graph::Graph`], which checks that they fit, and fills in
//! the rest of a [`crate::policy::Policy`]. The names of values in a format are private to its importer.

#[expect(missing_docs, reason = "docs/POLICY.md describes the keys")]
pub mod contract;
mod denoising;
mod folder;
mod importer;
#[expect(missing_docs, reason = "docs/POLICY.md describes the keys")]
pub mod json;
mod ops;
pub mod tensors;
pub mod values;

pub use denoising::{JsonDenoising, Sampler};
pub use folder::{FILES, PolicyFolder, PolicySource};
pub use importer::{Importer, folder_of};
