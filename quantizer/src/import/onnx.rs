//! Policies out of ONNX files, by rule: docs/IMPORT.md says what is taken.
//!
//! A file is read ([`proto`], `model`), followed from its inputs to the chosen output (`follow`), put together from what exporters
//! take apart (`build`, `norm`, `forms`), simplified and lowered to the ops of policy.json (`simplify`, `lower`).

mod action;
mod build;
mod call;
mod cells;
mod compare;
mod expr;
mod follow;
mod forms;
mod known;
mod layers;
mod lower;
mod model;
mod moves;
mod network;
mod norm;
mod places;
mod pointwise;
pub mod proto;
mod select;
mod simplify;
mod states;
mod tensor;

pub use network::{Choice, Imported, import, import_bytes};
