//! A small policy in a folder of its own with recordings, the faults that tests add to it, and helpers.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Output;

use actq::data::{self, NpzWriter};
use actq::graph::Evaluator;
use actq::policy::Policy;
use actq_bench::command::{actq, run, succeeded};
use actq_bench::golden::Random;
use actq_testkit::Dtype;
use anyhow::{Context, Result, ensure};
use ndarray::Array3;
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::folder;

pub(super) const OBS: usize = 40;
pub(super) const HIDDEN: usize = 64;
pub(super) const ACT: usize = 3;
pub(super) const CHUNK: usize = 4;
pub(super) const EXECUTE: usize = 2;
pub(super) const EPISODES: usize = 3;
pub(super) const STEPS: usize = 20;

/// A folder with a policy, its recordings and a place for images.
pub(super) struct Fixture(TempDir);

impl Fixture {
    pub(super) fn new() -> Result<Self> {
        let fixture = Self(TempDir::new()?);
        fs::create_dir(fixture.policy())?;
        fs::create_dir(fixture.0.path().join("out"))?;
        write_json(&fixture.policy(), &description())?;
        write_tensors(&fixture.policy(), &tensors())?;
        let policy = Policy::load(&fixture.policy())?;
        let mut evaluator = Evaluator::new(&policy.graph);
        for (name, seed) in [("calib.npz", 5), ("heldout.npz", 6)] {
            let obs = draw_observations(seed, OBS);
            let rows = obs.rows().into_iter().flat_map(|row| evaluator.step(&row.to_vec(), &mut |_, _| {}));
            let action = Array3::from_shape_vec((EPISODES, STEPS, CHUNK * ACT), rows.collect())?;
            write_recording(&fixture.policy().join(name), &obs, Some(&action), [STEPS as i64, 7, STEPS as i64])?;
        }
        Ok(fixture)
    }

    /// The same with a recording long enough to learn from.
    pub(super) fn with_long_recording() -> Result<Self> {
        let fixture = Self::new()?;
        let random = &mut Random::new(8);
        let obs = Array3::from_shape_simple_fn((1, 300, OBS), || 2.0 * random.unit());
        fs::remove_file(fixture.policy().join("calib.npz"))?;
        write_npy(&fixture.policy().join("calib.npy"), &obs)?;
        Ok(fixture)
    }

    pub(super) fn policy(&self) -> PathBuf {
        self.0.path().join("policy")
    }

    pub(super) fn out(&self, name: &str) -> PathBuf {
        self.0.path().join("out").join(name)
    }

    /// Runs `actq quantize` of the policy with more arguments, separated by spaces; with gptq unless they name a
    /// method. (The default method learns, for which the recording here is too short.)
    pub(super) fn quantize(&self, out: &Path, options: &str) -> Result<Output> {
        let method = if options.contains("--method") { "" } else { "--method gptq" };
        self.quantize_as_given(out, &format!("{options} {method}"))
    }

    pub(super) fn quantize_as_given(&self, out: &Path, options: &str) -> Result<Output> {
        let mut command = actq(&["quantize"]);
        command.arg(self.policy()).arg("--out").arg(out).args(options.split_whitespace());
        run(command, b"")
    }

    /// Quantizes, and requires success.
    pub(super) fn image(&self, options: &str) -> Result<PathBuf> {
        let out = self.out(&format!("{options}.actq"));
        succeeded(&self.quantize(&out, options)?).context(options.to_owned())?;
        Ok(out)
    }

    pub(super) fn eval(&self, image: &Path) -> Result<Value> {
        let mut command = actq(&["eval"]);
        command.arg(image).arg("--policy").arg(self.policy()).arg("--json");
        Ok(serde_json::from_str(&succeeded(&run(command, b"")?)?)?)
    }

    /// Every file's content and every folder.
    pub(super) fn snapshot(&self) -> Result<BTreeMap<PathBuf, Option<Vec<u8>>>> {
        Ok(actq_testkit::snapshot(self.0.path())?)
    }
}

pub(super) fn description() -> Value {
    json!({
        "name": "tiny arm", "kind": "chunk", "chunk": CHUNK, "execute": EXECUTE, "obs_dim": OBS, "act_dim": ACT,
        "control_hz": 25,
        "action": {
            "scale": [0.5, 1.0, 2.0], "offset": [0.125, 0.0, -0.25],
            "low": [-0.75, -1.5, -2.5], "high": [0.8125, 1.5, 2.5],
        },
        "ops": [
            {"op": "normalize", "mean": "norm.mean", "scale": "norm.scale", "clip": 5},
            {"op": "linear", "w": "in.weight", "b": "in.bias"},
            {"op": "tanh", "save": "h"},
            {"op": "linear", "w": "mid.weight"},
            {"op": "add", "with": "h"},
            {"op": "linear", "w": "out.weight", "b": "out.bias"},
        ],
    })
}

pub(super) type Tensors = BTreeMap<&'static str, folder::Tensor>;

/// Random weights; matrices keep the variance of their input.
pub(super) fn tensors() -> Tensors {
    let mut random = Random::new(4);
    let mut tensor = |name, shape: &[usize]| {
        let reach = if let [_, cols] = *shape { (3.0 / cols as f32).sqrt() } else { 1.0 };
        let bytes = (0..shape.iter().product()).flat_map(|_| (reach * random.unit()).to_le_bytes()).collect();
        (name, (Dtype::F32, shape.to_vec(), bytes))
    };
    Tensors::from([
        tensor("norm.mean", &[OBS]),
        tensor("norm.scale", &[OBS]),
        tensor("in.weight", &[HIDDEN, OBS]),
        tensor("in.bias", &[HIDDEN]),
        tensor("mid.weight", &[HIDDEN, HIDDEN]),
        tensor("out.weight", &[CHUNK * ACT, HIDDEN]),
        tensor("out.bias", &[CHUNK * ACT]),
    ])
}

pub(super) fn write_json(policy: &Path, json: &Value) -> Result<()> {
    Ok(fs::write(policy.join("policy.json"), json.to_string())?)
}

pub(super) fn write_tensors(policy: &Path, tensors: &Tensors) -> Result<()> {
    folder::write_tensors(policy, tensors.clone())
}

pub(super) fn draw_observations(seed: u64, width: usize) -> Array3<f32> {
    let mut random = Random::new(seed);
    Array3::from_shape_simple_fn((EPISODES, STEPS, width), || 2.0 * random.unit())
}

pub(super) fn write_recording(
    path: &Path,
    obs: &Array3<f32>,
    action: Option<&Array3<f32>>,
    length: [i64; EPISODES],
) -> Result<()> {
    let mut npz = NpzWriter::new(File::create(path)?);
    npz.array("obs", obs.shape(), obs.iter().copied())?;
    if let Some(action) = action {
        npz.array("action", action.shape(), action.iter().copied())?;
    }
    npz.array("length", &[EPISODES], length)?;
    npz.finish()?;
    Ok(())
}

/// Changes a value of policy.json, or adds a key.
pub(super) fn edit(policy: &Path, pointer: &str, value: Value) -> Result<()> {
    let mut json = description();
    if let Some(place) = json.pointer_mut(pointer) {
        *place = value;
    } else {
        let (parent, key) = pointer.rsplit_once('/').context("no pointer")?;
        json.pointer_mut(parent).context("policy.json lacks this place")?[key] = value;
    }
    write_json(policy, &json)
}

pub(super) fn text(path: &Path) -> String {
    path.display().to_string()
}

pub(super) fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

pub(super) fn cut(path: &Path, len: usize) -> Result<()> {
    let bytes = fs::read(path)?;
    Ok(fs::write(path, &bytes[..len])?)
}

/// Writes a recording of observations only.
pub(super) fn write_npy(path: &Path, obs: &Array3<f32>) -> Result<()> {
    Ok(data::write_npy(&mut File::create(path)?, obs.shape(), obs.iter().copied())?)
}

/// Lines on standard error, all of them notes, except the progress lines of a slow run.
pub(super) fn notes(output: &Output) -> Result<Vec<String>> {
    succeeded(output)?;
    let text = String::from_utf8(output.stderr.clone())?;
    let lines: Vec<String> = text.lines().filter(|l| !l.starts_with("progress: ")).map(str::to_owned).collect();
    ensure!(!text.contains(['\r', '\x1b']) && lines.iter().all(|line| line.starts_with("note: ")), "{text:?}");
    Ok(lines)
}
