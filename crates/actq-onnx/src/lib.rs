//! Importer of policies from ONNX files, by the rules in docs/IMPORT.md, and images as ONNX files ([`export`]).
//!
//! The import parses a file (`file`) and follows its graph from the inputs to the chosen output (`nodes`), which gives
//! expressions (`values`). It recognizes norms, activations and cells that exporters decompose, and simplifies
//! (`patterns`). Then it lowers the expressions to the ops of policy.json (`lower`).
#![deny(unsafe_code)]
#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

mod action;
mod caches;
pub mod export;
mod file;
mod lower;
mod network;
mod nodes;
mod patterns;
mod signature;
mod states;
mod values;

pub use file::proto;
pub use network::{Denoiser, ImportOptions, Imported, Onnx, OnnxFile, data_files, import, import_bytes};
pub use signature::Signature;
