//! Sizes of the arrays of a recording.

use actq_kernels::Image;
use actq_kernels::image::{Op, OpKind};

#[cfg(doc)]
use crate::graph::Graph;
use crate::policy::Policy;
use crate::runtime::prefix_len;

/// Sizes that a recording's arrays must fit.
#[derive(Clone, Copy, Debug)]
pub struct Sizes {
    /// Values of an observation, with those of a prefix.
    pub obs: usize,
    /// Values of noise that an evaluation takes ([`Graph::noise_len`]).
    pub noise: usize,
    /// Values of the network's raw output.
    pub out: usize,
    /// Values of the recurrent state ([`Graph::state_len`]); 0 if attention keeps tokens in it, which an image has in
    /// another form.
    pub state: usize,
}

impl Sizes {
    /// Returns the sizes of a policy.
    pub fn of(policy: &Policy) -> Self {
        let graph = &policy.graph;
        Self {
            obs: graph.obs_len,
            noise: graph.noise_len(),
            out: policy.chunk * policy.act_len,
            state: if graph.keeps_tokens() { 0 } else { graph.state_len() },
        }
    }

    /// Returns the sizes of an image.
    pub fn of_image(image: &Image<'_>) -> Self {
        let is_kept = |op: Op<'_>| op.kind == OpKind::Keep && image.state().range().contains(&op.dst().offset);
        let state = if image.ops().any(is_kept) { 0 } else { image.state().len };
        Self { obs: image.obs_len() + prefix_len(image), noise: image.noise_len(), out: image.output().len, state }
    }
}
