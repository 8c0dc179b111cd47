//! What several families' tests share.

pub(crate) mod isaaclab;
pub(crate) mod leapp;
pub(crate) mod lerobot;
pub(crate) mod made;
pub(crate) use actq_testkit::onnx;
