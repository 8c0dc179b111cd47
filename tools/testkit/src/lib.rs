//! Fixtures that the tests of several crates share. Only dev-dependencies and models for tests name this crate, and it
//! depends on no other crate of the workspace.
#![forbid(unsafe_code)]

mod line;
mod nor;
pub mod onnx;
mod power;
mod random;
mod snapshot;
#[cfg(feature = "tensors")]
mod tensors;

pub use line::{Fault, Line};
pub use nor::{NoPower, Nor};
pub use power::{Change, Power};
pub use random::Random;
#[cfg(feature = "tensors")]
pub use safetensors::Dtype;
pub use snapshot::snapshot;
#[cfg(feature = "tensors")]
pub use tensors::{f32_tensors, safetensors};

/// Deploy bundle of a robot of two joints whose motors are in the other order, and a history of two frames.
pub const TWO_JOINTS: &str = "
joint_ids_map: [1, 0]
step_dt: 0.01
stiffness: [10.0, 20.0]
damping: [1.0, 2.0]
default_joint_pos: [0.5, -0.5]
actions:
  JointPositionAction: {clip: null, scale: [0.25, 0.5], offset: [0.5, -0.5], joint_ids: null}
observations:
  joint_pos_rel: {clip: [-0.4, 0.4], scale: [2.0, 2.0], history_length: 2}
  last_action: {clip: null, scale: 1.0, history_length: 2}
";
