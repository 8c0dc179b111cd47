//! Reads a policy folder: `policy.json` (the op list) and `policy.safetensors` (the weights).

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use actq_kernels::image::Kind;
use serde_json::Value;
use sha2::{Digest, Sha256};

use super::importer::Importer;
use super::json::PolicyJson;
use super::ops::{Builder, Weights};
use super::tensors::{TensorFile, written};
use super::values::Tensor;
use crate::error::{Context, Result, bail, ensure};
use crate::graph::{hoist, without_ignored};
use crate::numbers::positive;
use crate::policy::{DEFAULT_RATE_HZ, Policy};

/// Files of a policy in its folder.
pub const FILES: [&str; 2] = ["policy.json", "policy.safetensors"];

/// The importer of policy folders.
#[derive(Clone, Copy, Debug)]
pub struct PolicyFolder;

impl Importer for PolicyFolder {
    fn accepts(&self, path: &Path) -> bool {
        path.is_dir()
    }

    fn files(&self, path: &Path) -> Vec<PathBuf> {
        FILES.map(|name| path.join(name)).to_vec()
    }

    fn load(&self, path: &Path) -> Result<Policy> {
        Policy::load(path)
    }
}

impl Policy {
    /// Reads `policy.json` and `policy.safetensors` from a folder. Every error names the file and the op or tensor.
    pub fn load(path: &Path) -> Result<Self> {
        ensure!(path.exists(), "{}: no such file or folder", path.display());
        ensure!(
            path.is_dir(),
            "{}: not a folder; name a folder that holds policy.json, or an .onnx file; `actq import` reads deploy bundles",
            path.display()
        );
        let [json_path, weights_path] = FILES.map(|name| path.join(name));
        ensure!(
            json_path.exists(),
            "{}: cannot read the file: it does not exist; of a deploy bundle, `actq import` makes a policy folder",
            json_path.display()
        );
        let json = fs::read(&json_path).with_context(|| format!("{}: cannot read the file", json_path.display()))?;
        let weights =
            fs::read(&weights_path).with_context(|| format!("{}: cannot read the file", weights_path.display()))?;
        Self::of_files(path, [&json_path, &weights_path], &json, &weights)
    }

    /// Makes a policy at `dir` from the bytes of its two files; `names` are their names in errors.
    pub fn of_files(dir: &Path, names: [&Path; 2], json: &[u8], weights: &[u8]) -> Result<Self> {
        let [json_name, weights_name] = names.map(|name| name.display().to_string());
        let parsed = PolicyJson::parse(json).with_context(|| json_name.clone())?;
        let file = TensorFile::new(weights).with_context(|| format!("{weights_name}: not a safetensors file"))?;
        let tensors = Weights { tensors: &file.all(), path: names[1] };
        build(dir, &parsed, tensors, digest([json, weights])).context(json_name)
    }
}

/// A policy folder in memory.
#[derive(Clone, Debug)]
pub struct PolicySource {
    /// policy.json
    pub json: PolicyJson,
    /// Keys of policy.json about the policy's origin, which are not read.
    pub about: Vec<(&'static str, Value)>,
    /// policy.safetensors
    pub tensors: BTreeMap<String, Tensor>,
}

impl PolicySource {
    /// Makes the policy at `dir`; `name` is its name in errors.
    ///
    /// # Errors
    ///
    /// As [`Policy::load`].
    pub fn policy(&self, dir: &Path, name: &Path) -> Result<Policy> {
        let [json, weights] = self.files()?;
        Ok(Policy { digest: digest([&json, &weights]), ..self.policy_without_digest(dir, name)? })
    }

    /// As [`Self::policy`], for a part of a policy that has its own digest; writes no files.
    ///
    /// # Errors
    ///
    /// As [`Policy::load`].
    pub fn policy_without_digest(&self, dir: &Path, name: &Path) -> Result<Policy> {
        let weights = Weights { tensors: &self.tensors, path: name };
        let policy = self.json.check_text().and_then(|()| build(dir, &self.json, weights, [0; 32]));
        policy.with_context(|| name.display().to_string())
    }

    /// Returns the bytes of [`FILES`]; policy.json has one op per line.
    ///
    /// # Errors
    ///
    /// If a tensor is not float32.
    pub fn files(&self) -> Result<[Vec<u8>; 2]> {
        let mut json = serde_json::to_string_pretty(&self.json)?;
        // Without the end of the object.
        json.truncate(json.len() - "\n}".len());
        for (key, value) in &self.about {
            json += &format!(",\n  \"{key}\": {value}");
        }
        let ops: Vec<String> =
            self.json.ops.iter().map(|op| Ok(format!("    {}", serde_json::to_string(op)?))).collect::<Result<_>>()?;
        json += &format!(",\n  \"ops\": [\n{}\n  ]\n}}\n", ops.join(",\n"));
        Ok([json.into_bytes(), written(&self.tensors)?])
    }
}

/// Returns the digest of a policy folder's two files.
fn digest(files: [&[u8]; 2]) -> [u8; 32] {
    let mut digest = Sha256::new();
    files.iter().for_each(|bytes| digest.update(bytes));
    digest.finalize().into()
}

fn build(dir: &Path, json: &PolicyJson, weights: Weights<'_>, digest: [u8; 32]) -> Result<Policy> {
    ensure!(
        json.obs_dim > 0 && json.act_dim > 0,
        "obs_dim is {} and act_dim {}; both must be at least 1",
        json.obs_dim,
        json.act_dim
    );
    for (name, n) in [("obs_dim", json.obs_dim), ("act_dim", json.act_dim), ("chunk", json.chunk.unwrap_or(1))] {
        ensure!(n <= usize::from(u16::MAX), "{name} is {n}; it must be at most 65535");
    }
    ensure!(!json.ops.is_empty(), "ops is empty; a policy needs at least one op");
    ensure!(json.name.len() <= 200, "name has {} bytes; at most 200 are allowed", json.name.len());
    let kind = json.kind()?;
    let (chunk, execute) = match kind {
        Kind::Step => (1, 1),
        Kind::Chunk | Kind::Flow | Kind::Diffusion => {
            let chunk = json.chunk.context("the key \"chunk\" is missing; a policy of several actions needs it")?;
            let execute = json.execute(chunk);
            ensure!((1..=chunk).contains(&execute), "execute is {execute}; it must be 1 to chunk ({chunk})");
            (chunk, execute)
        }
        kind => bail!("kind {kind:?} is not supported; use step, chunk, flow or diffusion"),
    };
    let add = |builder: &mut Builder<'_>| -> Result<()> {
        for (i, op) in json.ops.iter().enumerate() {
            builder.add(op).with_context(|| format!("op {i} ({})", op.op))?;
        }
        Ok(())
    };
    let prefix_len = json.prefix_len();
    ensure!(prefix_len <= usize::from(u16::MAX), "the prefix has {prefix_len} values; at most 65535 are supported");
    let (graph, (weights, parameters)) = if kind.is_iterative() {
        let len = chunk * json.act_dim;
        let by = &json.denoising;
        let schedule = by.schedule(kind, len)?;
        let (mut builder, times) = Builder::iterative([json.obs_dim, prefix_len], by, &schedule, weights)?;
        add(&mut builder)?;
        let trained = (builder.graph.weights(), builder.graph.parameters());
        (hoist::iterative(&builder.graph, json.obs_dim + prefix_len, &times, schedule.denoising)?, trained)
    } else {
        let mut builder = Builder::new(json.obs_dim, prefix_len, weights)?;
        add(&mut builder)?;
        let trained = (builder.graph.weights(), builder.graph.parameters());
        (builder.graph, trained)
    };
    let policy = Policy {
        dir: dir.to_owned(),
        name: json.name.clone(),
        kind,
        chunk,
        execute,
        act_len: json.act_dim,
        rate_hz: positive(json.control_hz.unwrap_or(f64::from(DEFAULT_RATE_HZ)), "control_hz")?,
        has_rate: json.control_hz.is_some(),
        contract: json.contract(kind)?,
        weights,
        parameters,
        graph: without_ignored(&graph),
        around: None,
        guards: Vec::new(),
        ports: String::new(),
        refused: Vec::new(),
        digest,
    };
    policy.check()?;
    Ok(policy)
}
