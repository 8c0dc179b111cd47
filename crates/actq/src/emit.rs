//! The bytes of an image, from a quantized network.

mod lower;
mod raw_values;
mod repack;
mod retrained;
mod writer;

pub use actq_kernels::cost::Core;
pub use lower::{Program, lower};
pub use raw_values::raw_values;
pub use repack::repack;
pub use retrained::{Trained, retrained};
pub use writer::{bytes_beside_blocks, image, image_around};
