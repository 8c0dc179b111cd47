//! Rivals and comparisons. This crate uses the quantizer's library; the library never uses this crate.
#![deny(unsafe_code)]

pub mod actquant;
pub mod commands;
pub mod compare;
pub mod host;
pub mod kquants;
pub mod pruned;
pub mod student;
// The library's own, which it compiles for its unit tests alone.
#[cfg(test)]
#[path = "../../crates/actq/src/testing.rs"]
#[allow(dead_code, reason = "the library's own tests use all of it")]
mod testing;
