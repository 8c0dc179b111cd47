//! A policy folder: `policy.json` (the op list) and `policy.safetensors` (the weights).

use std::fs;
use std::path::Path;

use actq_kernels::image::Kind;
use anyhow::{Context, Result, ensure};
use sha2::{Digest, Sha256};

use super::json::{Json, positive};
use super::ops::{Builder, Weights};
use super::tensors::TensorFile;
use crate::graph::hoist;
use crate::policy::Policy;

/// The files that make a policy, in its folder.
pub const FILES: [&str; 2] = ["policy.json", "policy.safetensors"];

impl Policy {
    /// Reads `policy.json` and `policy.safetensors` from `dir`. Every error names the file and the op or tensor.
    pub fn load(dir: &Path) -> Result<Self> {
        ensure!(dir.is_dir(), "{}: not a folder; give the one that holds policy.json", dir.display());
        let [json_path, weights_path] = FILES.map(|name| dir.join(name));
        let json_bytes = fs::read(&json_path).with_context(|| format!("{}: cannot be read", json_path.display()))?;
        let weight_bytes =
            fs::read(&weights_path).with_context(|| format!("{}: cannot be read", weights_path.display()))?;
        let json = Json::parse(&json_bytes).with_context(|| json_path.display().to_string())?;
        let file = TensorFile::new(&weight_bytes)
            .with_context(|| format!("{}: not a safetensors file", weights_path.display()))?;
        let mut digest = Sha256::new();
        digest.update(&json_bytes);
        digest.update(&weight_bytes);
        let weights = Weights { file, path: &weights_path };
        build(dir, &json, weights, digest.finalize().into()).with_context(|| json_path.display().to_string())
    }
}

fn build(dir: &Path, json: &Json, weights: Weights<'_>, digest: [u8; 32]) -> Result<Policy> {
    ensure!(json.obs_dim > 0 && json.act_dim > 0, "obs_dim and act_dim must be at least 1");
    for (name, n) in [("obs_dim", json.obs_dim), ("act_dim", json.act_dim), ("chunk", json.chunk.unwrap_or(1))] {
        ensure!(n <= usize::from(u16::MAX), "{name} is {n}, 65535 is the most");
    }
    ensure!(!json.ops.is_empty(), "ops is empty");
    ensure!(json.name.len() <= 200, "name is longer than 200 bytes");
    let kind = json.kind()?;
    let (chunk, execute) = match kind {
        Kind::Step => (1, 1),
        Kind::Chunk | Kind::Flow | Kind::Diffusion => {
            let chunk = json.chunk.context("a policy of several actions needs the key chunk")?;
            let execute = json.execute(chunk);
            ensure!((1..=chunk).contains(&execute), "execute is {execute}, it must be 1 to chunk ({chunk})");
            (chunk, execute)
        }
    };
    let add = |builder: &mut Builder<'_>| -> Result<()> {
        for (i, op) in json.ops.iter().enumerate() {
            builder.add(op).with_context(|| format!("op {i} ({})", op.op))?;
        }
        Ok(())
    };
    let (graph, weights) = if kind.is_iterative() {
        let len = chunk * json.act_dim;
        let by = &json.denoising;
        let schedule = if kind == Kind::Flow { by.flow(len)? } else { by.diffusion(len)? };
        let (mut builder, times) = Builder::iterative(json.obs_dim, by, &schedule, weights)?;
        add(&mut builder)?;
        let trained = builder.graph.weights();
        (hoist::iterative(&builder.graph, json.obs_dim, &times, schedule.denoising)?, trained)
    } else {
        let mut builder = Builder::new(json.obs_dim, weights);
        add(&mut builder)?;
        let trained = builder.graph.weights();
        (builder.graph, trained)
    };
    let policy = Policy {
        dir: dir.to_owned(),
        name: json.name.clone(),
        kind,
        chunk,
        execute,
        act_len: json.act_dim,
        rate_hz: positive(json.control_hz.unwrap_or(50.0), "control_hz")?,
        contract: json.contract(kind)?,
        weights,
        graph,
        digest,
    };
    policy.check()?;
    Ok(policy)
}
