//! Files of kinfer 0.6: archives of two graphs and their metadata.

use std::collections::BTreeMap;
use std::slice;

use actq::error::{Context as _, Result, bail, ensure};
use actq::text::printable;

use super::super::common::{Parts, check_names, counts, known, listed};
use crate::bundle::Bundle;
use crate::description::{Description, Network, Numbers, TargetKind};
use crate::document::Document;
use crate::facts::Facts;
use crate::family::Recognized;
use crate::sources::Sources as _;

/// Files of an archive, after its path.
pub(super) const STEP: &str = ".kinfer/step_fn.onnx";
const FILES: [&str; 3] = ["step_fn.onnx", "init_fn.onnx", "metadata.json"];

/// Finds the files of an archive; nothing if the file is none.
pub(super) fn recognize(bundle: &Bundle, file: &str) -> Result<Option<Recognized>> {
    let paths = FILES.map(|name| format!("{file}/{name}"));
    let own: Vec<&str> = bundle.files().filter(|own| own.starts_with(&format!("{file}/"))).collect();
    if own.is_empty() {
        return Ok(None);
    }
    for path in &paths {
        ensure!(bundle.has(path), "{path} is missing: kinfer's archives have {}", FILES.join(", "));
    }
    if let Some(other) = own.iter().find(|own| paths.iter().all(|path| path != *own)) {
        bail!("{}: kinfer's archives have {} only", printable(other), FILES.join(", "));
    }
    let [step, init, metadata] = paths;
    let documents = vec![Document::read(bundle, &metadata)?];
    Ok(Some(Recognized { documents, networks: vec![step], others: vec![init] }))
}

pub(super) fn read(bundle: &Bundle, found: &Recognized, facts: &mut Facts) -> Result<Description> {
    let (meta, file) = (&found.documents[0], &found.networks[0]);
    let signature = bundle.signature(file)?;
    let (inputs, outputs) = (known(file, &signature.inputs)?, known(file, &signature.outputs)?);
    let joints = meta.texts("joint_names")?;
    check_names(&joints, &meta.location("joint_names"))?;
    let [(action, n), (next, carried)] = &outputs[..] else {
        bail!("{file}: it has the outputs {}; an action and a carry are needed", listed(&outputs));
    };
    if *n != joints.len() {
        return Err(Facts::contradiction(
            "number of joints",
            (&meta.location("joint_names"), &joints.len().to_string()),
            (&format!("{file}: output {:?}", printable(action)), &n.to_string()),
        ));
    }
    let mut parts = Parts::new("policy", facts.positive("packed.rate_hz")?);
    facts.note("joint order", meta.location("joint_names"));
    parts.joints("robot", joints);
    let mut network =
        Network { name: "policy".to_owned(), file: file.clone(), inputs: BTreeMap::new(), states: BTreeMap::new() };
    let read_by = |outputs: &[String]| -> Result<Vec<(String, usize)>> {
        Ok(bundle.network(&network, outputs).with_context(|| file.clone())?.inputs().to_vec())
    };
    let mut used = read_by(slice::from_ref(action))?;
    // A network without memory returns its carry as it is.
    if used.iter().any(|(name, _)| name == "carry") {
        used = read_by(&[action.clone(), next.clone()])?;
    }
    for (input, len) in &inputs {
        let expected = expected(meta, input, *n)?;
        if *len != expected {
            return Err(Facts::contradiction(
                &format!("length of the input {:?}", printable(input)),
                (&meta.file, &expected.to_string()),
                (file, &len.to_string()),
            ));
        }
        // No output depends on the others.
        if used.iter().all(|(name, _)| name != input) {
            continue;
        }
        match input.as_str() {
            "joint_angles" => parts.raw_joints(input, "robot", "rad"),
            "joint_angular_velocities" => parts.raw_joints(input, "robot", "rad/s"),
            "projected_gravity" => parts.raw(input, *len, ""),
            "accelerometer" => parts.raw(input, *len, "m/s^2"),
            "gyroscope" => parts.raw(input, *len, "rad/s"),
            "time" => parts.raw(input, *len, "s"),
            "command" => parts.raw(input, *len, &meta.texts("command_names")?.join(", ")),
            _ => {
                ensure!(carried == len, "{file}: the carry has {len} values, and its next value {carried}");
                let start = initial(bundle, &found.others[0], *len)?;
                facts.note(input, format!("{}; output {:?}", found.others[0], printable(next)));
                parts.state_from(input, *len, Numbers::Each(start), &format!("policy.{next}"));
            }
        }
        network.inputs.insert(input.clone(), input.clone());
    }
    parts.wired(network);
    parts.act(&format!("policy.{action}"));
    let kind: Option<TargetKind> = facts.value("packed.target")?;
    facts.note("target", facts.source("packed.target"));
    parts.value("target", &format!("policy.{action}"), Vec::new());
    parts.target_joints(kind.unwrap_or(TargetKind::Position), "target", "robot");
    Ok(parts.finish())
}

/// Returns the length that an input must have.
fn expected(meta: &Document, input: &str, joints: usize) -> Result<usize> {
    Ok(match input {
        "joint_angles" | "joint_angular_velocities" => joints,
        "projected_gravity" | "accelerometer" | "gyroscope" => 3,
        "time" => 1,
        "command" => meta.texts("command_names")?.len(),
        "carry" => meta.required("carry_size", "a list of lengths", counts)?.iter().product(),
        other => bail!("{}: the input {:?} matches none of kinfer's", meta.file, printable(other)),
    })
}

/// Returns the first carry, which the other graph computes of nothing.
fn initial(bundle: &Bundle, file: &str, len: usize) -> Result<Vec<f64>> {
    let onnx = bundle.onnx(file)?;
    let signature = onnx.signature();
    let ([], [(output, _)]) = (&signature.inputs[..], &signature.outputs[..]) else {
        bail!("{file}: it must have no input and one output, the first carry");
    };
    let values = onnx.constant(output)?.with_context(|| format!("{file}: its output is not constant"))?;
    ensure!(values.len() == len, "{file}: it gives {} values, and the carry has {len}", values.len());
    Ok(values)
}
