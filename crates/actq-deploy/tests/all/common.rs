//! What several families' tests share.

pub(crate) mod difference;
pub(crate) mod made;
mod network;
pub(crate) use actq_testkit::onnx;
