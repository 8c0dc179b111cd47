//! The bytes of an ONNX file: protobuf messages, and the graph in them.

pub(crate) mod model;
pub mod proto;
