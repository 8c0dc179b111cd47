//! Rivals and comparisons. This crate uses the quantizer's library; the library never uses this crate.
#![forbid(unsafe_code)]

pub mod compare;
pub mod kquants;
