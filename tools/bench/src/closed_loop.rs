//! Closed loops of the UR3 task within this process.

use actq_kernels::Head;
use actq_ur3::task::{Outcome, run_episode};
use anyhow::Result;

/// Runs an episode with a fallible policy; returns its first error.
pub fn episode(seed: u64, mut step: impl FnMut(&[f32]) -> Result<[f32; 6]>) -> Result<Outcome> {
    let mut failure = None;
    let outcome = run_episode(seed, |obs| {
        if failure.is_some() {
            return [0.0; 6];
        }
        step(obs).unwrap_or_else(|error| {
            failure = Some(error);
            [0.0; 6]
        })
    });
    failure.map_or(Ok(outcome), Err)
}

/// Runs an episode with the executor as the policy, from a reset.
pub fn episode_on_host(head: &mut Head<'_, '_>, seed: u64) -> Result<Outcome> {
    head.reset();
    episode(seed, |obs| Ok(head.step(obs)?.try_into()?))
}
