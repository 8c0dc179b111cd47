//! Parsing of ONNX files: protobuf messages, and the graph in them.

pub(crate) mod kinds;
pub(crate) mod model;
pub mod proto;
