//! A simulated UR3 arm with a reach-and-hold task, an expert controller, and the plain `f32` runner of the policy that
//! was trained to imitate the expert.
//!
//! Units throughout: metres, radians, seconds. Joints are ordered base, shoulder, elbow, wrist 1, wrist 2, wrist 3.
//!
//! ```
//! use actq_ur3::task::run_episode;
//!
//! // A policy that never moves does not reach the goals.
//! let outcome = run_episode(0, |_observation| [0.0; 6]);
//! assert!(!outcome.success);
//! ```
#![forbid(unsafe_code)]

pub mod expert;
pub mod kinematics;
#[cfg(not(target_family = "wasm"))]
pub mod pipe;
#[cfg(not(target_family = "wasm"))]
pub mod policy_f32;
pub mod random;
pub mod servo;
#[cfg(not(target_family = "wasm"))]
pub mod summary;
pub mod task;

use std::path::Path;

/// Returns the folder of the trained policy and its recordings.
pub fn policy_folder() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/policy"))
}

/// Returns the folder of the flow policy, whose chunks start from noise, with its recordings.
pub fn flow_folder() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/flow"))
}

/// Number of values in one observation; [`task::Task::observe`] gives their order.
pub const OBS_DIM: usize = 18;

/// Number of values in one action: six joint velocity commands, rad/s.
pub const ACT_DIM: usize = 6;

/// Control steps in one action chunk.
pub const CHUNK: usize = 8;
