//! Policies from ONNX files: the actions of every exporter's form agree with another reader of ONNX, and no file does
//! harm.

mod attention;
mod bounds;
mod cases;
mod command;
mod constants;
mod damaged;
mod denoiser;
mod exporters;
mod file;
mod integers;
mod norms;
mod notation;
mod recorded;
mod styles;
#[cfg(feature = "tract")]
mod tract;

use std::path::Path;

use actq::measure::actions::actions;
use actq::policy::Policy;
use actq_onnx::{ImportOptions, Imported, import_bytes};
use actq_testkit::Random;
use anyhow::{Result, ensure};

use self::recorded::by_tract;

/// Steps to compare.
const STEPS: usize = 6;
/// Tolerance, relative to the largest action.
const TOLERANCE: f32 = 1e-5;

fn imported(bytes: &[u8], options: &ImportOptions) -> Result<(Imported, Policy)> {
    let imported = import_bytes(bytes.to_vec(), Path::new("."), "test", options)?;
    let name = Path::new("policy.json");
    let policy = imported.policy(Path::new("."), name)?;
    // The files hold the same network.
    let [json, weights] = imported.source.files()?;
    let read = Policy::of_files(Path::new("."), [name; 2], &json, &weights)?;
    let parts = |policy: &Policy| {
        policy.graph.nodes.iter().map(|node| (node.kind.clone(), node.inputs.clone())).collect::<Vec<_>>()
    };
    let is_same = parts(&read) == parts(&policy) && read.graph.matrices == policy.graph.matrices;
    ensure!(is_same && read.digest == policy.digest, "the policy folder holds another policy");
    Ok((imported, policy))
}

fn drawn(policy: &Policy) -> Vec<Vec<f32>> {
    let mut random = Random::new(3);
    (0..STEPS).map(|_| (0..policy.graph.input_len()).map(|_| 2.0 * random.unit()).collect()).collect()
}

/// Requires that the policy's actions agree with tract's.
fn same(bytes: &[u8]) -> Result<Imported> {
    let (imported, policy) = imported(bytes, &ImportOptions::default())?;
    let observations = drawn(&policy);
    compare(&by_tract(bytes, &imported, &observations)?, &actions(&policy, &observations))?;
    Ok(imported)
}

/// Requires that the import refuses the file with a message that contains these words.
fn refused(bytes: &[u8], expected: &str) {
    let error = format!("{:#}", imported(bytes, &ImportOptions::default()).expect_err(expected));
    assert!(error.contains(expected), "{error} instead of {expected}");
}

fn compare(expected: &[Vec<f32>], ours: &[Vec<f32>]) -> Result<()> {
    let (expected, ours) = (expected.concat(), ours.concat());
    ensure!(expected.len() == ours.len(), "{} values, {} are ours", expected.len(), ours.len());
    let scale = expected.iter().fold(0f32, |most, v| most.max(v.abs()));
    let error = expected.iter().zip(&ours).fold(0f32, |most, (a, b)| most.max((a - b).abs()));
    ensure!(scale > 1e-3, "an output that is always 0 proves nothing");
    ensure!(error <= TOLERANCE * scale, "error {error} at scale {scale}");
    Ok(())
}
