//! The tests that take more than one crate are in `tests/all`. Here, the examples of README.md are compiled and run.
#![forbid(unsafe_code)]
#![cfg_attr(doctest, doc = include_str!(concat!(env!("OUT_DIR"), "/examples.md")))]
