//! Images as ONNX graphs in f32, with dequantized weights, for tools that do not read images.

mod builder;
mod file;
mod operations;
#[cfg(test)]
mod tests;

pub use builder::{Attribute, Data, Grid, Network, Node, Tensor};
pub use file::file;
pub use operations::network;
