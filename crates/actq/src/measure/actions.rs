//! Actions of the f32 policy: the network's output through the action contract.

use ndarray::Array2;

use crate::graph::{Network, Weights, zero_state};
use crate::policy::Policy;

/// Returns what the f32 policy gives for each of `observations`, from a zero state on: all actions of its output in
/// order, scaled, offset and limited. The step limit is not applied, since it holds between executed actions only.
pub fn actions(policy: &Policy, observations: &[Vec<f32>]) -> Vec<Vec<f32>> {
    let (network, weights) = (Network::new(&policy.graph), Weights::of(&policy.graph));
    let mut state = zero_state(&policy.graph, 1);
    let one = |(i, raw): (usize, &f32)| policy.contract.apply(i % policy.act_len, *raw);
    let mut step = |obs: &Vec<f32>| {
        let obs = Array2::from_shape_fn((1, obs.len()), |(_, i)| obs[i]);
        network.forward(&weights, obs, &mut state).output().iter().enumerate().map(one).collect()
    };
    observations.iter().map(&mut step).collect()
}
