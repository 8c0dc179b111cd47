//! From a quantized network to the bytes of an image.

mod lower;
mod writer;

pub use lower::{Program, lower};
pub use writer::{bytes_beside_blocks, image};
