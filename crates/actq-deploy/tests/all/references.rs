//! Comparisons with references: recorded actions, rounding, limits, and orders of joints.

use std::fs;
use std::path::Path;

use actq::data::NpzWriter;
use actq::error::{Result, ensure};
use actq_deploy::description::{Description, Numbers};
use actq_deploy::{Bundle, Comparison, Reference, TOLERANCE, orders};
use tempfile::TempDir;

use crate::common::onnx;

const TICKS: usize = 20;
const DEPLOY: &str = r#"
schema = 1
name = "two"
rate_hz = 50
action = "policy.action"
joints.robot = ["hip", "knee", "ankle"]
constants = { default = [0.1, 0.2, 0.3], action_scale = [0.5, 0.5, 0.5] }
[[input]]
name = "q"
joints = "robot"
[[state]]
name = "last"
len = 3
next = "policy.action"
[[value]]
name = "position"
from = "q"
do = [{ subtract = "default" }]
[[value]]
name = "observation"
from = ["position", "last"]
[[value]]
name = "target"
from = "policy.action"
do = [{ scale = "action_scale" }, { add = "default" }]
[[network]]
name = "policy"
file = "policy.onnx"
inputs = { actor_obs = "observation" }
[[target]]
kind = "position"
value = "target"
joints = "robot"
"#;

/// Positions of the joints, which have the same statistics.
fn positions(tick: usize) -> [f64; 3] {
    [0, 1, 2].map(|joint| (0.7 * tick as f64 + 2.1 * f64::from(joint)).sin())
}

/// Writes arrays of all ticks.
fn write(path: &Path, arrays: &[(&str, &Vec<f32>)]) -> Result<()> {
    let mut npz = NpzWriter::new(fs::File::create(path)?);
    for (name, values) in arrays {
        npz.array(name, &[TICKS, values.len() / TICKS], values.iter().copied())?;
    }
    npz.finish()?;
    Ok(())
}

/// A reference and its description in a folder.
struct Case {
    folder: TempDir,
    description: Description,
}

impl Case {
    /// Makes the reference by the code's arithmetic: the code's `q` has the joints `order` of the raw ones, its scale is
    /// `scale`, and `noise` is in each action that is recorded, fed back and sent.
    fn new(order: [usize; 3], scale: f64, noise: f64) -> Result<Self> {
        let folder = TempDir::new()?;
        let weights: Vec<f32> = onnx::weights(6, 3).into_iter().map(|weight| 5.0 * weight).collect();
        let tensors = [("weight", &[6, 3][..], weights.clone()), ("bias", &[3], vec![0.5; 3])];
        let nodes = [("Gemm", &["actor_obs", "weight", "bias"][..], "action")];
        let network = onnx::graph(&nodes, &tensors, &[("actor_obs", 6)], &[("action", 3)], &[]);
        fs::write(folder.path().join("policy.onnx"), network)?;
        let (mut raw, mut observations, mut actions, mut targets) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let mut last = [0.0f64; 3];
        for tick in 0..TICKS {
            let q = positions(tick).map(|value| value as f32);
            raw.extend(q);
            let own = [0, 1, 2].map(|i| f64::from(q[order[i]]) - 0.1 * (i + 1) as f64);
            let observation = [own, last].concat();
            let sum =
                |j: usize| observation.iter().enumerate().map(|(i, x)| x * f64::from(weights[3 * i + j])).sum::<f64>();
            last = [0, 1, 2].map(|j| 0.5 + sum(j) + noise);
            observations.extend(observation.iter().map(|value| *value as f32));
            actions.extend(last.map(|value| value as f32));
            targets.extend([0, 1, 2].map(|j| (last[j] * scale + 0.1 * (j + 1) as f64) as f32));
        }
        write(&folder.path().join("raw.npz"), &[("q", &raw)])?;
        let expected = [("observation", &observations), ("action", &actions), ("target", &targets)];
        write(&folder.path().join("expect.npz"), &expected)?;
        Ok(Self { folder, description: Description::parse(DEPLOY)? })
    }

    fn reference(&self) -> Result<Reference> {
        Reference::read(&self.folder.path().join("raw.npz"), &self.folder.path().join("expect.npz"))
    }

    fn compare(&self) -> Result<Comparison> {
        self.reference()?.compare(&self.description, &Bundle::open(self.folder.path())?)
    }

    fn orders(&self) -> Result<Vec<String>> {
        orders(&self.description, &Bundle::open(self.folder.path())?, &self.reference()?)
    }
}

#[test]
fn recorded_actions_are_fed_back() -> Result<()> {
    let mut case = Case::new([0, 1, 2], 0.5, 1e-5)?;
    let comparison = case.compare()?;
    ensure!(comparison.first.is_none(), "{comparison:?}");
    // The noise in each action is within the tolerance, and what it adds up to is the drift.
    ensure!(comparison.largest["action"] < TOLERANCE && comparison.drift["action"] > TOLERANCE, "{comparison:?}");
    case.description.states[0].next = "target".to_owned();
    let first = case.compare()?.first;
    ensure!(first.as_ref().is_some_and(|first| first.tick == 1 && first.kind == "observation"), "{first:?}");
    Ok(())
}

#[test]
fn joints_in_another_order_are_named() -> Result<()> {
    let case = Case::new([1, 2, 0], 0.5, 0.0)?;
    ensure!(case.compare()?.first.is_some(), "no difference");
    let found = case.orders()?;
    let expected = "the reference has position in another order: its hip is the description's knee, its knee is the \
                    description's ankle, its ankle is the description's hip";
    ensure!(found == [expected], "{found:?}");
    let mut same = Case::new([0, 1, 2], 0.5, 0.0)?;
    ensure!(same.orders()?.is_empty(), "the same order");
    // Names in another order move the default pose only.
    same.description.constants.insert("default".to_owned(), vec![0.3, 0.2, 0.1]);
    let found = same.orders()?;
    let [position, target] =
        ["position", "target"].map(|of| format!("the reference has {of} with other offsets: hip "));
    let offsets = found[0].contains("hip +0.2000, ankle -0.2000") && found[1].contains("hip -0.2000, ankle +0.2000");
    ensure!(
        found.len() == 2 && found[0].starts_with(&position) && found[1].starts_with(&target) && offsets,
        "{found:?}"
    );
    Ok(())
}

#[test]
fn rounding_explains_no_more_than_its_size() -> Result<()> {
    let mut case = Case::new([0, 1, 2], 0.5004, 0.0)?;
    ensure!(case.compare()?.first.is_some(), "no difference");
    case.description.rounding.insert("action_scale".to_owned(), 0.0005);
    let comparison = case.compare()?;
    let [most, of] = comparison.rounded["target"];
    ensure!(comparison.first.is_none() && most > 1e-5 && most < of, "{comparison:?}");
    case.description.rounding.insert("action_scale".to_owned(), 0.0002);
    let first = case.compare()?.first;
    ensure!(first.as_ref().is_some_and(|first| first.kind == "target"), "{first:?}");
    Ok(())
}

#[test]
fn limits_hold_expected_targets() -> Result<()> {
    let mut case = Case::new([0, 1, 2], 0.5, 0.0)?;
    case.description.targets[0].limits = Some([Numbers::All(-9.0), Numbers::All(0.4)]);
    let comparison = case.compare()?;
    ensure!(comparison.first.is_none() && comparison.held > 0, "{comparison:?}");
    case.description.targets[0].limits = Some([Numbers::All(-9.0), Numbers::All(9.0)]);
    ensure!(case.compare()?.held == 0, "targets within the limits");
    Ok(())
}
