//! Plain `f32` runner of an exported policy: the baseline for quantized policies.

use std::collections::VecDeque;
use std::path::Path;

use actq::contract::ActionContract;
use actq::graph::{Network, Weights, zero_state};
use actq::policy::Policy;
use anyhow::{Result, ensure};
use ndarray::{Array1, Axis};

use crate::random::Random;
use crate::{ACT_DIM, OBS_DIM};

/// Seed of a flow's noise after each reset.
const NOISE_SEED: u64 = 1;

/// A chunk policy: the network proposes a chunk of actions, and the first `execute` of them are played before the next
/// evaluation. The chunk is the network's output; for a flow it is noise that has followed the network's velocities.
#[derive(Debug)]
pub struct PolicyF32 {
    policy: Policy,
    weights: Weights,
    noise: Random,
    queue: VecDeque<[f32; ACT_DIM]>,
}

impl PolicyF32 {
    /// Loads `policy.json` and `policy.safetensors` from the folder `dir`.
    ///
    /// # Errors
    /// A file is missing or malformed, or the policy does not map [`OBS_DIM`] observations to chunks of [`ACT_DIM`]
    /// actions, without a state, within limits.
    pub fn load(dir: &Path) -> Result<Self> {
        Self::new(Policy::load(dir)?)
    }

    fn new(policy: Policy) -> Result<Self> {
        let (graph, contract) = (&policy.graph, &policy.contract);
        let lengths = [graph.obs_len, policy.act_len];
        ensure!(
            lengths == [OBS_DIM, ACT_DIM],
            "obs_dim and act_dim are {lengths:?}, this task has {OBS_DIM} and {ACT_DIM}"
        );
        ensure!(graph.state_len() == 0, "{}: recurrent policies are not supported", policy.name);
        let [_, _, _, _, others @ ..] = contract.arrays();
        let is_plain = others.iter().all(|(_, array)| array.is_none());
        ensure!(
            is_plain && contract.playback.ensemble.is_none() && contract.playback.overlap == 0,
            "{}: of the action contract only scale, offset, low and high are supported",
            policy.name
        );
        let (weights, noise) = (Weights::of(graph), Random::new(NOISE_SEED));
        Ok(Self { policy, weights, noise, queue: VecDeque::new() })
    }

    /// Clears the queued actions and restarts the noise; call it before every episode.
    pub fn reset(&mut self) {
        self.queue.clear();
        self.noise = Random::new(NOISE_SEED);
    }

    /// Returns `true` if its output depends on noise.
    pub fn draws(&self) -> bool {
        self.policy.graph.denoising.is_some()
    }

    /// Returns the next action (joint velocities, rad/s) for the observation `obs` ([`OBS_DIM`] values).
    ///
    /// # Panics
    /// `obs` has another length.
    pub fn act(&mut self, obs: &[f32]) -> [f32; ACT_DIM] {
        if self.queue.is_empty() {
            let raw = self.raw(obs);
            let (actions, _) = raw.as_chunks::<ACT_DIM>();
            let contract = &self.policy.contract;
            self.queue.extend(actions.iter().take(self.policy.execute).map(|action| apply(contract, action)));
        }
        self.queue.pop_front().expect("execute is at least 1")
    }

    /// Computes the network's output for `obs` ([`OBS_DIM`] values): normalised actions, chunk step by chunk step.
    ///
    /// # Panics
    /// `obs` has another length.
    pub fn raw(&mut self, obs: &[f32]) -> Vec<f32> {
        assert_eq!(obs.len(), OBS_DIM, "length of the observation");
        let graph = &self.policy.graph;
        let noise = (0..graph.noise_len()).map(|_| self.noise.normal() as f32);
        let input = Array1::from_iter(obs.iter().copied().chain(noise)).insert_axis(Axis(0));
        let pass = Network::new(graph).forward(&self.weights, input, &mut zero_state(graph, 1));
        pass.into_output().into_iter().collect()
    }
}

/// From network output to joint velocity (rad/s): `raw * scale + offset`, then clamped to `[low, high]`.
fn apply(contract: &ActionContract, raw: &[f32; ACT_DIM]) -> [f32; ACT_DIM] {
    let of = |array: &Option<Vec<f32>>, i: usize, default| array.as_ref().map_or(default, |values| values[i]);
    let ActionContract { scale, offset, low, high, .. } = contract;
    core::array::from_fn(|i| {
        let action = raw[i] * of(scale, i, 1.0) + of(offset, i, 0.0);
        action.clamp(of(low, i, f32::NEG_INFINITY), of(high, i, f32::INFINITY))
    })
}

#[cfg(test)]
mod tests {
    use actq::graph::ops::Linear;
    use actq::graph::{Graph, WeightMatrix};

    use super::*;

    /// A network of one linear layer with zero weights and bias 0, 1, 2, ... for chunks of 3 actions.
    fn policy(obs_len: usize) -> Policy {
        let rows = 3 * ACT_DIM;
        let mut graph = Graph::new(obs_len);
        graph.matrices.push(WeightMatrix { name: "w".into(), rows, cols: obs_len, data: vec![0.0; rows * obs_len] });
        let bias = (0..rows).map(|i| i as f32).collect();
        graph.add(Linear { matrix: 0, bias }, &[0]).expect("it fits");
        let all = |value| Some(vec![value; ACT_DIM]);
        let contract =
            ActionContract { scale: all(2.0), offset: all(1.0), low: all(0.0), high: all(20.0), ..Default::default() };
        Policy { chunk: 3, execute: 2, act_len: ACT_DIM, contract, ..Policy::of("linear", graph) }
    }

    #[test]
    fn chunk_actions_pass_through_the_contract() {
        let mut policy = PolicyF32::new(policy(OBS_DIM)).unwrap();
        let obs = [0.0; OBS_DIM];
        assert_eq!(policy.raw(&obs).len(), 3 * ACT_DIM);
        let first = [1.0, 3.0, 5.0, 7.0, 9.0, 11.0];
        assert_eq!(policy.act(&obs), first);
        assert_eq!(policy.act(&obs), [13.0, 15.0, 17.0, 19.0, 20.0, 20.0]);
        assert_eq!(policy.act(&obs), first);
        policy.reset();
        assert_eq!(policy.act(&obs), first);
    }

    #[test]
    fn unsuitable_policies_are_refused() {
        assert!(PolicyF32::new(policy(3)).is_err());
        let mut limited = policy(OBS_DIM);
        limited.contract.max_step = Some(vec![1.0; ACT_DIM]);
        assert!(PolicyF32::new(limited).is_err());
        assert!(PolicyF32::load(Path::new("no-such-folder")).is_err());
    }
}
