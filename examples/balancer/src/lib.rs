//! A simulated robot that balances on two wheels, its task, and the expert that the policy in `bundle/` was trained to
//! imitate.
//!
//! Units throughout: metres, radians, seconds, newtons. Motors are ordered right, left.
//!
//! ```
//! use actq_balancer::run_episode;
//!
//! // A robot without torque falls.
//! assert!(!run_episode(0, |_raw| Ok([0.0; 2]))?.success);
//! # anyhow::Ok(())
//! ```
#![forbid(unsafe_code)]

pub mod expert;
/// The generator of `actq`, without the rest of that crate, which browsers have no use for.
#[allow(dead_code, unreachable_pub, reason = "shared with actq, which uses all of it")]
#[path = "../../../crates/actq/src/random.rs"]
mod random;
mod robot;
mod task;

use std::path::Path;

pub use robot::{State, TORQUE_LIMIT};
pub use task::{EPISODE_STEPS, Outcome, RATE_HZ, RAW_LEN, Task, run_episode};

/// Returns the folder of the policy, as it would be published.
pub fn bundle() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/bundle"))
}

/// Returns the folder of a policy with attention: a causal transformer over the last 16 frames.
pub fn transformer() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/transformer"))
}
