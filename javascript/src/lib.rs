//! The kernels as a WebAssembly module, for browsers and Node.
//!
//! For wasm32-unknown-unknown this crate is the module. For other targets it has that module as bytes, which `cargo xtask
//! wasm` has compiled, and the [`Products`] that the module computes with.

#[cfg(target_family = "wasm")]
pub mod exports;
mod products;

pub use products::Products;

/// The compiled module, by gzip.
#[cfg(not(target_family = "wasm"))]
pub const MODULE: &[u8] = include_bytes!("../actq.wasm.gz");

/// The module's face in JavaScript.
#[cfg(not(target_family = "wasm"))]
pub const FACE: &str = include_str!("../actq.js");
