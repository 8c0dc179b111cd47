//! A policy as it was trained.

use std::path::PathBuf;

use actq_kernels::image::Kind;
use anyhow::{Result, ensure};

use crate::contract::ActionContract;
use crate::graph::Graph;

/// A policy as it was trained.
#[derive(Clone, Debug)]
pub struct Policy {
    /// Where it was read from.
    pub dir: PathBuf,
    /// Its name.
    pub name: String,
    /// What its output means.
    pub kind: Kind,
    /// Actions in the network's output; 1 for [`Kind::Step`].
    pub chunk: usize,
    /// Actions executed of a chunk.
    pub execute: usize,
    /// Length of an action.
    pub act_len: usize,
    /// Control rate in Hz.
    pub rate_hz: f32,
    /// What stands between the output and the robot.
    pub contract: ActionContract,
    /// The network.
    pub graph: Graph,
    /// Weights of all its matrices as they were trained, which bits per weight refer to.
    pub weights: usize,
    /// SHA-256 of policy.json, then policy.safetensors.
    pub digest: [u8; 32],
}

impl Policy {
    /// That output, chunk, action and contract fit each other.
    pub fn check(&self) -> Result<()> {
        let (len, expected) = (self.graph.len_of(self.graph.output()), self.chunk * self.act_len);
        ensure!(len == expected, "the last op gives {len} values, chunk * act_dim is {expected}");
        self.contract.playback.check(self.chunk, self.execute)?;
        self.contract.check(self.act_len)
    }
}
