//! Policies from ONNX files: the actions of every exporter's form agree with another reader of ONNX, and no file does
//! harm.

mod bounds;
mod cases;
mod command;
mod constants;
mod damaged;
mod exporters;
mod file;
mod integers;
mod norms;
mod notation;
mod styles;

use std::path::Path;

use actq::measure::actions::actions;
use actq::policy::Policy;
use actq_onnx::{ImportOptions, Imported, import_bytes, proto};
use actq_testkit::Random;
use anyhow::{Context as _, Result, ensure};
use prost::Message as _;
use prost::bytes::Bytes;
use tract_onnx::prelude::*;

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
    (0..STEPS).map(|_| (0..policy.graph.obs_len).map(|_| 2.0 * random.unit()).collect()).collect()
}

/// Computes the actions with tract, step by step, with every state carried on. Inputs have the file's shapes, in the
/// file's order.
fn by_tract(bytes: &[u8], imported: &Imported, observations: &[Vec<f32>]) -> Result<Vec<Vec<f32>>> {
    let mut model = tract_onnx::onnx().model_for_read(&mut &bytes[..])?;
    let ports = ports(bytes)?;
    for (i, (_, shape)) in ports.iter().enumerate() {
        model.set_input_fact(i, f32::fact(shape).into())?;
    }
    let outputs: Vec<String> =
        [&imported.output.0].into_iter().chain(imported.states.iter().map(|(_, to, _)| to)).cloned().collect();
    model.select_outputs_by_name(&outputs)?;
    let model = model.into_optimized()?.into_runnable()?;
    let mut states: Vec<Vec<f32>> = imported.states.iter().map(|(.., len)| vec![0.0; *len]).collect();
    let mut all = Vec::new();
    for obs in observations {
        let mut inputs = TVec::new();
        for (name, shape) in &ports {
            let mut at = 0;
            let mut values = vec![0.0; shape.iter().product()];
            for (input, len) in &imported.inputs {
                if input == name {
                    values.copy_from_slice(&obs[at..at + len]);
                }
                at += len;
            }
            if let Some(i) = imported.states.iter().position(|(from, ..)| from == name) {
                values.clone_from(&states[i]);
            }
            inputs.push(Tensor::from_shape(shape, &values)?.into());
        }
        let mut results = model.run(inputs)?.into_iter().map(|value| values(&value));
        all.push(results.next().context("no action")??);
        states = results.collect::<Result<_>>()?;
    }
    Ok(all)
}

/// Returns the inputs of a file with their shapes; a dynamic axis becomes 1.
fn ports(bytes: &[u8]) -> Result<Vec<(String, Vec<usize>)>> {
    let graph = proto::Graph::decode(proto::Model::decode(bytes)?.graph.context("a graph")?)?;
    let port = |bytes: &Bytes| -> Result<(String, Vec<usize>)> {
        let port = proto::ValueInfo::decode(bytes.clone())?;
        let shape = port.r#type.and_then(|t| t.tensor_type?.shape).context("a shape")?;
        let axis = |bytes: &Bytes| Ok(proto::Dimension::decode(bytes.clone())?.dim_value.map_or(1, |n| n as usize));
        Ok((port.name.unwrap_or_default(), shape.dim.iter().map(axis).collect::<Result<_>>()?))
    };
    graph.input.iter().map(port).collect()
}

fn values(value: &TValue) -> Result<Vec<f32>> {
    Ok(value.to_plain_array_view::<f32>()?.iter().copied().collect())
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
