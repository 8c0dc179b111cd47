//! A small policy with recordings, in a folder in which commands run.

use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;
use std::process::Output;

use actq::data::{Dataset, Sizes};
use actq::policy::Policy;
use actq_bench::command::{actq, research, run, succeeded};
use actq_bench::golden::Random;
use anyhow::{Context, Result};
use ndarray::Array3;
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::folder;

pub(super) const OBS: usize = 16;
pub(super) const HIDDEN: usize = 40;
pub(super) const ACT: usize = 3;
/// Rows of the first matrix with almost no output.
pub(super) const IDLE: [usize; 3] = [3, 11, 30];

/// A policy 16 -> 40 tanh -> 40 tanh -> 3 with recordings, and a place for files.
pub(super) struct Fixture(TempDir);

impl Fixture {
    pub(super) fn new() -> Result<Self> {
        let fixture = Self(TempDir::new()?);
        let dir = fixture.policy();
        fs::create_dir(&dir)?;
        let linear = |name| json!({"op": "linear", "w": name});
        let ops = [linear("first"), json!({"op": "tanh"}), linear("second"), json!({"op": "tanh"}), linear("last")];
        let json = json!({
            "name": "small leg", "kind": "step", "obs_dim": OBS, "act_dim": ACT, "control_hz": 50, "ops": ops,
        });
        let mut random = Random::new(4);
        let mut matrix = |rows: usize, cols: usize| -> Vec<f32> {
            (0..rows * cols).map(|_| random.unit() * (3.0 / cols as f32).sqrt()).collect()
        };
        let (mut first, second, last) = (matrix(HIDDEN, OBS), matrix(HIDDEN, HIDDEN), matrix(ACT, HIDDEN));
        for row in IDLE {
            first[row * OBS..][..OBS].iter_mut().for_each(|w| *w *= 1e-3);
        }
        let tensors = [("first", HIDDEN, OBS, first), ("second", HIDDEN, HIDDEN, second), ("last", ACT, HIDDEN, last)]
            .map(|(name, rows, cols, data)| (name, vec![rows, cols], data));
        folder::write_policy(&dir, &json, tensors)?;
        let policy = Policy::load(&dir)?;
        for (name, seed) in [("calib.npz", 5), ("heldout.npz", 6)] {
            let mut random = Random::new(seed);
            let obs = Array3::from_shape_simple_fn((2, 150, OBS), || 2.0 * random.unit());
            let mut recording = Dataset { path: name.into(), obs, action: None, length: vec![150; 2], state: None };
            recording.fill_actions(&policy.graph);
            fs::write(dir.join(name), recording.npz(Sizes::of(&policy))?)?;
        }
        Ok(fixture)
    }

    pub(super) fn policy(&self) -> PathBuf {
        self.path("policy")
    }

    pub(super) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Runs a command, its arguments separated by spaces, in the fixture's folder; one with method actquant in the
    /// research command.
    pub(super) fn actq(&self, line: &str) -> Result<Output> {
        let mut command = if line.contains("actquant") { research(&[]) } else { actq(&[]) };
        command.current_dir(self.0.path()).args(line.split_whitespace());
        run(command, b"")
    }

    pub(super) fn quantize(&self, options: &str) -> Result<Output> {
        self.actq(&format!("quantize policy {options}"))
    }

    /// Makes an image `NAME.actq` and its statistics `NAME.json`.
    pub(super) fn image(&self, name: &str, options: &str) -> Result<Value> {
        succeeded(&self.quantize(&format!("--out {name}.actq --save-stats {name}.json {options}"))?)?;
        Ok(serde_json::from_slice(&fs::read(self.path(&format!("{name}.json")))?)?)
    }

    pub(super) fn nmse(&self, image: &str) -> Result<f64> {
        let report: Value =
            serde_json::from_str(&succeeded(&self.actq(&format!("eval {image} --policy policy --json"))?)?)?;
        report["nmse"].as_f64().context("nmse")
    }

    /// Returns the content of everything in the folder.
    pub(super) fn files(&self) -> Result<BTreeMap<PathBuf, Option<Vec<u8>>>> {
        Ok(actq_testkit::snapshot(self.0.path())?)
    }
}
