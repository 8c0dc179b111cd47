//! Octo's diffusion head (Ghosh et al., arXiv 2405.12213): the noise in a chunk of actions, from a time code, a readout
//! token of the transformer and the noisy chunk.

use anyhow::Result;
use serde_json::{Value, json};

use crate::Head;
use crate::network::{Network, with};

const HIDDEN: usize = 256;
const BLOCKS: usize = 3;
const TIME: usize = 32;
const CHUNK: usize = 4;
const ACT: usize = 7;
/// Denoising steps of training, and the default of a call.
pub const STEPS: usize = 20;
/// Octo limits the iterate to this; actions are normalised to mean 0 and standard deviation 1.
const MAX_ACTION: f64 = 5.0;

/// Builds the head on a readout token of `token` values (384 in Octo-Small, 768 in Octo-Base), in `steps` denoising
/// steps.
pub fn head(token: usize, steps: usize) -> Result<Head> {
    let mut network = Network::new();
    // Octo learns these; here they have their initial values.
    network.normal("time.freq", &[TIME / 2], 0.2);
    let mut ops = vec![
        with(network.linear("time.0", 2 * TIME, TIME), "input", "tfeat"),
        json!({"op": "silu"}),
        with(network.linear("time.1", TIME, 2 * TIME), "save", "time"),
        with(network.linear("in", HIDDEN, TIME + token + CHUNK * ACT), "input", json!(["time", "obs", "x"])),
    ];
    for i in 0..BLOCKS {
        let residual = format!("h{i}");
        ops.extend([
            json!({"op": "identity", "save": residual}),
            network.layernorm(&format!("block.{i}.norm"), HIDDEN, 1e-6),
            network.linear(&format!("block.{i}.up"), 4 * HIDDEN, HIDDEN),
            json!({"op": "silu"}),
            network.linear(&format!("block.{i}.down"), HIDDEN, 4 * HIDDEN),
            json!({"op": "add", "with": residual}),
        ]);
    }
    ops.extend([json!({"op": "silu"}), network.linear("out", CHUNK * ACT, HIDDEN)]);
    let limits = |limit: f64| Value::from(vec![limit; ACT]);
    let json = json!({
        "name": format!("octo_{token}"), "source": "seeded random weights",
        "kind": "diffusion", "train_steps": STEPS, "steps": steps, "schedule": "cosine", "prediction": "epsilon",
        "variance": "large", "clip_iterate": MAX_ACTION,
        "chunk": CHUNK, "obs_dim": token, "act_dim": ACT,
        "action": {"low": limits(-MAX_ACTION), "high": limits(MAX_ACTION)},
        "ops": ops,
    });
    Ok(Head { json, weights: network.safetensors()? })
}
