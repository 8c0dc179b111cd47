//! Tests of more than one crate are in `tests/all`. Here, the Rust examples of the documents are compiled and run.
#![forbid(unsafe_code)]
#![cfg_attr(doctest, doc = include_str!(concat!(env!("OUT_DIR"), "/examples.md")))]
