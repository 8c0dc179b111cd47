//! Fixtures that the tests of several crates share. Only dev-dependencies and models for tests name this crate, and it
//! depends on no other crate of the workspace.
#![forbid(unsafe_code)]

mod line;
mod nor;
pub mod onnx;
mod power;
mod random;
#[cfg(feature = "tensors")]
mod tensors;

pub use line::{Fault, Line};
pub use nor::{NoPower, Nor};
pub use power::{Change, Power};
pub use random::Random;
#[cfg(feature = "tensors")]
pub use safetensors::Dtype;
#[cfg(feature = "tensors")]
pub use tensors::{f32_tensors, safetensors};
