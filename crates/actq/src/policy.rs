//! The policy as it was trained.

use std::path::PathBuf;

use actq_kernels::image::Kind;

use crate::around::Around;
use crate::contract::ActionContract;
use crate::error::{Result, ensure};
use crate::graph::Graph;
use crate::text::count;

/// Control steps a second of a policy that states no rate.
pub const DEFAULT_RATE_HZ: f32 = 50.0;

/// A policy as it was trained.
#[derive(Clone, Debug)]
pub struct Policy {
    /// Folder that it was read from.
    pub dir: PathBuf,
    /// Its name.
    pub name: String,
    /// Meaning of its output.
    pub kind: Kind,
    /// Actions in the network's output; 1 for [`Kind::Step`].
    pub chunk: usize,
    /// Actions executed of a chunk.
    pub execute: usize,
    /// Length of an action.
    pub act_len: usize,
    /// Control rate in Hz.
    pub rate_hz: f32,
    /// `true` if its source states the rate; else it is [`DEFAULT_RATE_HZ`].
    pub has_rate: bool,
    /// Action contract.
    pub contract: ActionContract,
    /// The network; a policy of a folder is read without what it ignores ([`without_ignored`](crate::graph::without_ignored)).
    pub graph: Graph,
    /// Operations around the network in an image; the network's observations and actions then differ from the image's.
    pub around: Option<Around>,
    /// Nodes of its source that replace or limit NaN and infinity, with what they do. The network has none of these.
    pub guards: Vec<String>,
    /// Inputs and outputs of its source, a line for what each is, and for those that are left out; empty if it has no
    /// others.
    pub ports: String,
    /// Outputs of its source that are named action but cannot be a part of it, with the reasons.
    pub refused: Vec<String>,
    /// Weights of all its matrices as they were trained; the divisor of bits per weight.
    pub weights: usize,
    /// Trained values ([`Graph::parameters`]), counted before what depends on the time alone became tables.
    pub parameters: usize,
    /// SHA-256 of policy.json, then policy.safetensors.
    pub digest: [u8; 32],
}

impl Policy {
    /// Makes a policy of kind step from a network whose output is the action: 50 steps a second, no contract, no
    /// folder.
    pub fn of(name: &str, graph: Graph) -> Self {
        Self {
            dir: PathBuf::new(),
            name: name.to_owned(),
            kind: Kind::Step,
            chunk: 1,
            execute: 1,
            act_len: graph.len_of(graph.output()),
            rate_hz: DEFAULT_RATE_HZ,
            has_rate: false,
            contract: ActionContract::default(),
            weights: graph.weights(),
            parameters: graph.parameters(),
            graph,
            around: None,
            guards: Vec::new(),
            ports: String::new(),
            refused: Vec::new(),
            digest: [0; 32],
        }
    }

    /// Checks that output, chunk, action and contract fit each other.
    ///
    /// # Errors
    ///
    /// Names the key in policy.json that does not fit.
    pub fn check(&self) -> Result<()> {
        let (len, expected) = (self.graph.len_of(self.graph.output()), self.chunk * self.act_len);
        ensure!(len == expected, "the last op gives {}, but chunk * act_dim is {expected}", count(len, "value"));
        self.contract.playback.check(self.chunk, self.execute)?;
        self.contract.check(self.act_len)
    }
}
