//! OpenVLA-OFT's head for L1 regression (Kim et al., arXiv 2502.19645): every action of a chunk from the hidden states
//! of its tokens, through the same residual network.

use anyhow::Result;
use serde_json::json;

use crate::Head;
use crate::network::{Network, with};

/// Values of a hidden state, and width of the network, in OpenVLA-OFT.
pub const HIDDEN: usize = 4096;
const BLOCKS: usize = 2;
const CHUNK: usize = 8;
const ACT: usize = 7;

/// Returns the number of weights of the matrices at a hidden size.
pub fn weights(hidden: usize) -> usize {
    (ACT * hidden + BLOCKS * hidden + ACT) * hidden
}

/// Builds the head with hidden states of `hidden` values. The observation is that of the whole chunk: 8 x 7 hidden
/// states.
pub fn head(hidden: usize) -> Result<Head> {
    let mut network = Network::new();
    let input = ACT * hidden;
    let mut layers =
        vec![network.layernorm("norm.in", input, 1e-5), network.linear("in", hidden, input), json!({"op": "relu"})];
    for i in 0..BLOCKS {
        layers.extend([
            json!({"op": "identity", "save": "h"}),
            network.layernorm(&format!("block.{i}.norm"), hidden, 1e-5),
            network.linear(&format!("block.{i}"), hidden, hidden),
            json!({"op": "relu"}),
            json!({"op": "add", "with": "h"}),
        ]);
    }
    layers.extend([network.layernorm("norm.out", hidden, 1e-5), network.linear("out", ACT, hidden)]);
    let mut ops = Vec::new();
    for i in 0..CHUNK {
        let first = ops.len();
        ops.extend(layers.iter().cloned());
        ops[first] = with(ops[first].take(), "input", format!("obs[{}:{}]", i * input, (i + 1) * input));
        let last = ops.len() - 1;
        ops[last] = with(ops[last].take(), "save", format!("action{i}"));
    }
    let actions: Vec<String> = (0..CHUNK).map(|i| format!("action{i}")).collect();
    ops.push(json!({"op": "identity", "input": actions}));
    let json = json!({
        "name": format!("oft_{hidden}"), "source": "seeded random weights",
        "kind": "chunk", "chunk": CHUNK, "obs_dim": CHUNK * input, "act_dim": ACT, "ops": ops,
    });
    Ok(Head { json, weights: network.safetensors()? })
}
