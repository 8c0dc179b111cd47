//! Policies out of ONNX files, by rule: docs/IMPORT.md says what is taken.
//!
//! A file is read ([`proto`], `model`), followed from its inputs to the chosen output (`follow`), put together from
//! what exporters take apart (`build`, `norm`, `forms`), simplified and lowered to the ops of policy.json (`simplify`,
//! `lower`).
#![deny(unsafe_code)]

mod action;
mod arithmetic;
mod bounds;
mod build;
mod call;
mod cells;
mod compare;
mod conditions;
mod convolutions;
mod einsum;
mod elements;
mod evaluation;
mod expr;
mod follow;
mod forms;
mod functions;
mod gather;
mod integers;
mod known;
mod lower;
mod model;
mod moves;
mod network;
mod norm;
mod parts;
mod places;
mod pointwise;
mod pools;
mod products;
pub mod proto;
mod reductions;
mod rows;
mod select;
mod simplify;
mod slices;
mod states;
mod tensor;
mod totals;

pub use network::{Choice, Imported, Onnx, import, import_bytes};
