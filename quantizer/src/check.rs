//! `actq import --check`: compares the policy with runs of its ONNX file by other programs.

use std::env;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use actq::data::Dataset;
use actq::measure::actions::actions;
use actq::policy::Policy;
use actq::random::Random;
use actq::text::count;
use actq_onnx::Imported;
use anyhow::{Context as _, Result, bail, ensure};

use crate::agreement::{InFloat64, error, verdict};

/// Observations of the check, drawn or from a recording.
const FRAMES: usize = 256;

/// Programs that `check.py` runs the file with.
#[derive(Clone, Copy)]
enum Runner {
    Onnxruntime,
    Float64,
}

/// Compares the policy's actions with those of its file. Returns the number of observations, the reference and the
/// error as text.
pub(crate) fn check(model: &Path, imported: &Imported, policy: &Policy, calib: Option<&Dataset>) -> Result<String> {
    let observations = match calib {
        Some(calib) => calib.episode(0).take(FRAMES).collect(),
        None => random_observations(imported),
    };
    let ours: Vec<f64> = actions(policy, &observations).concat().into_iter().map(f64::from).collect();
    let of_file = |runner| {
        let values = run(runner, model, imported, &observations)?;
        ensure!(
            values.len() == ours.len(),
            "the file gives {} values, the policy {}; this is an error of this program, please report it",
            values.len(),
            ours.len()
        );
        Ok(values)
    };
    let expected = of_file(Runner::Onnxruntime)?;
    let in_float64 = || {
        let exact = of_file(Runner::Float64)?;
        ensure!(exact.iter().all(|v| v.is_finite()), "the file's own actions are not finite in float64");
        Ok(InFloat64 { policy: error(&exact, &ours), onnxruntime: error(&exact, &expected) })
    };
    let summary = verdict(error(&expected, &ours), in_float64).with_context(|| model.display().to_string())?;
    Ok(format!("{} {summary}", count(observations.len(), "observation")))
}

/// Draws observations for all inputs, rounded if the file takes integers.
fn random_observations(imported: &Imported) -> Vec<Vec<f32>> {
    let mut random = Random::new(1);
    let whole = |(name, len): &(String, usize)| vec![imported.integers.contains(name); *len];
    let whole: Vec<bool> = imported.inputs.iter().flat_map(whole).collect();
    let mut value = |whole: &bool| {
        let value = 2.0 * random.unit();
        if *whole { (100.0 * value).round() } else { value }
    };
    (0..FRAMES).map(|_| whole.iter().map(&mut value).collect()).collect()
}

/// Runs the file over the observations in Python. Returns all actions, one after the other.
fn run(runner: Runner, model: &Path, imported: &Imported, observations: &[Vec<f32>]) -> Result<Vec<f64>> {
    let states: Vec<[&str; 2]> = imported.states.iter().map(|(from, to, _)| [from.as_str(), to]).collect();
    let plan = serde_json::json!({ "inputs": imported.inputs, "states": states, "output": imported.output.0 });
    let python = env::var_os("ACTQ_PYTHON").unwrap_or_else(|| "python3".into());
    let failed =
        "cannot run the file with onnxruntime for --check; set ACTQ_PYTHON to a Python (default python3) that has it";
    let mut child = Command::new(python)
        .args(["-c", include_str!("check.py")])
        .arg(model)
        .arg(plan.to_string())
        .arg(match runner {
            Runner::Onnxruntime => "onnxruntime",
            Runner::Float64 => "float64",
        })
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .context(failed)?;
    let bytes: Vec<u8> = observations.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
    // Python may have ended without reading; its message then gives the reason.
    let _ = child.stdin.take().context("Python has no standard input")?.write_all(&bytes);
    let output = child.wait_with_output().context(failed)?;
    if !output.status.success() {
        let message = String::from_utf8_lossy(&output.stderr).trim().to_owned();
        match runner {
            Runner::Onnxruntime => bail!("{failed}: {message}"),
            Runner::Float64 => bail!(message),
        }
    }
    Ok(output.stdout.as_chunks().0.iter().map(|b| f64::from_le_bytes(*b)).collect())
}
