//! `actq import --check`: compares the policy with runs of its ONNX file by other programs.

use std::env;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use actq::data::{Dataset, runs};
use actq::measure::actions::actions;
use actq::policy::Policy;
use actq::text::count;
use actq_onnx::Imported;
use anyhow::{Context as _, Result, bail, ensure};

use crate::agreement::{InFloat64, error, float64_verdict, verdict};
use crate::probes::probes;

/// Observations of the check from a recording, or of each round that is drawn.
const FRAMES: usize = 256;
/// Largest magnitude of drawn observations, in deviations of the policy's normalizers.
const MAGNITUDE: f32 = 2.0;
/// Status of `check.py` for a file that its runner cannot run.
const NOT_RUN: i32 = 3;

/// Programs that `check.py` runs the file with.
#[derive(Clone, Copy)]
enum Runner {
    Onnxruntime,
    Float64,
}

/// Compares the policy's actions with those of its file. Returns the number of observations, the reference and the
/// error as text. Fails if an action stays constant that depends on an input: nothing is known of it.
pub(crate) fn check(model: &Path, imported: &Imported, policy: &Policy, calib: Option<&Dataset>) -> Result<String> {
    let mut observations = calib.map(|calib| calib.episode(0).take(FRAMES).collect::<Vec<_>>()).unwrap_or_default();
    let recorded = observations.len();
    if recorded == 0 || !still(imported, &observed(policy, &observations)).is_empty() {
        observations.extend(probes(imported, policy, &[MAGNITUDE], FRAMES));
    }
    let summary = compare(model, imported, policy, &observations).with_context(|| model.display().to_string())?;
    // The others were drawn because of these.
    let first = if recorded == 0 { FRAMES } else { recorded };
    let still = still(imported, &observed(policy, &observations[..first]));
    let note = match still.is_empty() {
        true => String::new(),
        false => format!("; {} constant over the first {first}", actions_text(&still)),
    };
    Ok(format!("{} {summary}{note}", count(observations.len(), "observation")))
}

/// Returns the reference and the error as text.
fn compare(model: &Path, imported: &Imported, policy: &Policy, observations: &[Vec<f32>]) -> Result<String> {
    let ours = observed(policy, observations);
    let of_file = |runner| {
        let run = run(runner, model, imported, policy, observations)?;
        if let Ok(values) = &run {
            ensure!(
                values.len() == ours.len(),
                "the file gives {} values, the policy {}; internal error; please report it",
                values.len(),
                ours.len()
            );
            let still = still(imported, values);
            ensure!(
                still.is_empty(),
                "the check shows nothing about {}, constant over {}; pass observations with --calib over which they change",
                actions_text(&still),
                count(observations.len(), "observation")
            );
        }
        anyhow::Ok(run)
    };
    let in_float64 = || match of_file(Runner::Float64)? {
        Ok(exact) => {
            ensure!(exact.iter().all(|v| v.is_finite()), "the file's own actions are not finite in float64");
            Ok(exact)
        }
        Err(reason) => bail!(reason),
    };
    match of_file(Runner::Onnxruntime)? {
        Ok(expected) => verdict(error(&expected, &ours), || {
            let exact = in_float64()?;
            Ok(InFloat64 { policy: error(&exact, &ours), onnxruntime: error(&exact, &expected) })
        }),
        Err(reason) => float64_verdict(&reason, in_float64().map(|exact| error(&exact, &ours))),
    }
}

/// Returns the policy's actions, one after the other.
fn observed(policy: &Policy, observations: &[Vec<f32>]) -> Vec<f64> {
    actions(policy, observations).concat().into_iter().map(f64::from).collect()
}

/// Returns the indices of actions that are the same for all observations, without those that depend on no input.
fn still(imported: &Imported, actions: &[f64]) -> Vec<usize> {
    let n = imported.output.1;
    let varies = |i: usize| actions.chunks(n).any(|row| row[i] != actions[i]);
    (0..n).filter(|i| !imported.constant.contains(i) && !varies(*i)).collect()
}

fn actions_text(which: &[usize]) -> String {
    format!("{} {}", if which.len() == 1 { "action" } else { "actions" }, runs(which))
}

/// Runs the file over the observations in Python. Returns all actions, one after the other, or why the runner cannot
/// run the file.
fn run(
    runner: Runner,
    model: &Path,
    imported: &Imported,
    policy: &Policy,
    observations: &[Vec<f32>],
) -> Result<std::result::Result<Vec<f64>, String>> {
    let states: Vec<[&str; 2]> = imported.states.iter().map(|(from, to, _)| [from.as_str(), to]).collect();
    let sampler = imported.denoiser.as_ref().zip(policy.graph.denoising.as_ref()).map(|(inputs, denoising)| {
        let steps: Vec<_> = denoising.steps.iter().map(|by| by.to_array()).collect();
        let limit = |limit: f64| limit.is_finite().then_some(limit);
        serde_json::json!({
            "iterate": inputs.iterate, "time": inputs.time, "times": inputs.times, "steps": steps,
            "values": denoising.len, "noise": denoising.noise_len(), "limit": limit(denoising.limit.into()), "clip_iterate": inputs.clip_iterate,
        })
    });
    let inputs: Vec<_> = imported.inputs.iter().chain(&imported.prefix.inputs).collect();
    let plan = serde_json::json!({
        "inputs": inputs, "states": states, "output": imported.output.0, "sampler": sampler,
    });
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
    let bytes: Vec<u8> = observations.iter().flat_map(|row| imported.of_file(row)).flat_map(f32::to_le_bytes).collect();
    // Python may have ended without reading; its message then gives the reason.
    let _ = child.stdin.take().context("Python has no standard input")?.write_all(&bytes);
    let output = child.wait_with_output().context(failed)?;
    if !output.status.success() {
        let message = String::from_utf8_lossy(&output.stderr).trim().to_owned();
        match (output.status.code(), runner) {
            (Some(NOT_RUN), _) => return Ok(Err(message)),
            (_, Runner::Onnxruntime) => bail!("{failed}: {message}"),
            (_, Runner::Float64) => bail!(message),
        }
    }
    Ok(Ok(output.stdout.as_chunks().0.iter().map(|b| f64::from_le_bytes(*b)).collect()))
}
