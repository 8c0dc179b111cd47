//! Policies out of ONNX files, by rule: docs/IMPORT.md says what is taken.
//!
//! A file is read (`file`), followed from its inputs to the chosen output (`nodes`, over the expressions of `values`), put
//! together from what exporters take apart and simplified (`patterns`), and lowered to the ops of policy.json (`lower`).
#![deny(unsafe_code)]

mod action;
mod file;
mod lower;
mod network;
mod nodes;
mod patterns;
mod states;
mod values;

pub use file::proto;
pub use network::{Choice, Imported, Onnx, import, import_bytes};
