//! Operations of an image around its network, and its raw inputs and targets.

use actq_kernels::PortKind;

use crate::graph::lowering::{Buffer, BufferId, Slice, Step};

/// The buffer that stands for the network's output in [`Around::after`].
pub const OUTPUT: BufferId = BufferId::MAX;

/// A raw input, or targets.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedPort {
    /// Input, or the quantity of a target.
    pub kind: PortKind,
    /// Its name.
    pub name: String,
    /// Names of its values, as those of joints; empty if they have none.
    pub names: Vec<String>,
    /// Number of values.
    pub len: usize,
    /// Lowest and highest value that a step accepts; infinite for no limit.
    pub range: [f32; 2],
}

/// The operations around a network, over buffers. Buffer 0 holds the raw values, which the caller writes.
#[derive(Clone, Debug)]
pub struct Around {
    /// The buffers: that of raw values, states, and values.
    pub buffers: Vec<Buffer>,
    /// Operations before the network.
    pub before: Vec<Step<Slice>>,
    /// Buffer of the network's observation.
    pub observation: BufferId,
    /// Operations after the network.
    pub after: Vec<Step<Slice>>,
    /// Buffer of the action, which the image returns.
    pub action: BufferId,
    /// Lowest and highest value of the action, if it has limits.
    pub limits: Option<[Vec<f32>; 2]>,
    /// Raw inputs in the order of the raw values, then targets in the order of the action.
    pub ports: Vec<NamedPort>,
}

impl Around {
    /// Returns the number of raw values.
    pub fn raw_len(&self) -> usize {
        self.buffers[0].len
    }

    /// Returns the length of the action.
    pub fn action_len(&self) -> usize {
        self.buffers[self.action].len
    }
}
