//! Targets and gains of the joints among a pipeline's outputs.

use actq::error::{Context as _, Result, bail, ensure};
use actq::text::printable;

use super::model::{Model, Port};
use super::pipeline::{At, Pipeline};
use crate::bundle::Bundle;
use crate::description::TargetKind;
use crate::facts::Facts;

/// Lists the outputs that are targets of joints.
pub(super) fn targets(models: &[Model], pipeline: &Pipeline, facts: &mut Facts) -> Result<Vec<(At, TargetKind)>> {
    let mut targets = Vec::new();
    for at in &pipeline.outputs {
        let port = &models[at.0].outputs[at.1];
        // From schema 1.4 on, kinds have no direction.
        let kind = match port.kind.strip_prefix("target/").unwrap_or(&port.kind) {
            "kp" | "kd" => continue,
            "joint/position" => TargetKind::Position,
            "joint/velocity" => TargetKind::Velocity,
            "joint/effort" | "joint/torques" => TargetKind::Torque,
            _ => match asked(port, facts)? {
                Some(kind) => kind,
                None => continue,
            },
        };
        ensure!(
            !port.is_series,
            "{}: it gives values of several times, and an image gives those of one tick; export the first of them",
            port.at
        );
        targets.push((*at, kind));
    }
    ensure!(
        !targets.is_empty(),
        "pipeline.outputs: no output is a target of joints; export one of the kind target/joint/position, velocity or torques"
    );
    Ok(targets)
}

/// Asks for the target that an output of another kind is; `None` if it is none.
fn asked(port: &Port, facts: &mut Facts) -> Result<Option<TargetKind>> {
    let key = format!("target.{}", port.name);
    let kind = if port.kind.is_empty() { "none" } else { &port.kind };
    let meaning = format!(
        "which target of joints is the output {:?} of the kind {:?}: \"position\", \"velocity\", \"torque\", or \"none\"?",
        printable(&port.name),
        printable(kind)
    );
    let answer: Option<String> = facts.missing(&key, &meaning)?;
    Ok(match answer.as_deref() {
        None | Some("position") => Some(TargetKind::Position),
        Some("velocity") => Some(TargetKind::Velocity),
        Some("torque") => Some(TargetKind::Torque),
        Some("none") => None,
        Some(other) => {
            bail!("answer {key} = {:?}: give \"position\", \"velocity\", \"torque\" or \"none\"", printable(other))
        }
    })
}

/// Gains of joints.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Gain {
    pub(super) values: Vec<f64>,
    /// Names of the joints; empty if none are given.
    pub(super) names: Vec<String>,
    pub(super) at: String,
}

/// Reads the stiffness and the damping, if the pipeline gives both.
pub(super) fn gains(bundle: &Bundle, models: &[Model], pipeline: &Pipeline) -> Result<Option<[Gain; 2]>> {
    let of = |kind: &str| -> Result<Gain> {
        let mut gain = Gain::default();
        for (model, output) in &pipeline.outputs {
            let (model, port) = (&models[*model], &models[*model].outputs[*output]);
            if port.kind != kind {
                continue;
            }
            let values = bundle.onnx(&model.file)?.constant(&port.graph);
            let values = values.with_context(|| port.at.clone())?.with_context(|| {
                format!("{}: the policy computes this gain, and an image has fixed gains; export fixed ones", port.at)
            })?;
            gain.values.extend(values);
            gain.names.extend(port.names.iter().flatten().cloned());
            gain.at.clone_from(&port.at);
        }
        Ok(gain)
    };
    let (stiffness, damping) = (of("kp")?, of("kd")?);
    if stiffness.values.is_empty() || damping.values.is_empty() {
        return Ok(None);
    }
    let is_whole = |gain: &Gain| gain.names.is_empty() || gain.names.len() == gain.values.len();
    if stiffness.names != damping.names || !is_whole(&stiffness) || stiffness.values.len() != damping.values.len() {
        let shown = |gain: &Gain| format!("{} values of {}", gain.values.len(), gain.names.join(", "));
        return Err(Facts::contradiction(
            "joints of the gains",
            (&stiffness.at, &shown(&stiffness)),
            (&damping.at, &shown(&damping)),
        ));
    }
    Ok(Some([stiffness, damping]))
}
