//! From a quantized network to the bytes of an image, and into files.

pub mod files;
mod lower;
pub mod unfinished;
mod writer;

pub use lower::{Program, lower};
pub use writer::{bytes_beside_blocks, image};
