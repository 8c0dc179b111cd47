//! K-Scale's `.kinfer` files: an ONNX graph with `kinfer_metadata`, which assembles the observation and its history
//! itself, beside the robot's MuJoCo file.

mod graph;
mod inputs;
mod joints;
mod packed;
mod robot;

use std::collections::BTreeMap;

use actq::error::{Context as _, Result, bail, ensure};
use actq::text::printable;

use self::graph::{Graph, Outputs};
use self::inputs::inputs;
use self::joints::{default_pose, gains, joint_names};
use self::robot::Robot;
use super::common::Parts;
use crate::bundle::Bundle;
use crate::description::{Description, Op, Operand, TargetKind};
use crate::document::Document;
use crate::facts::Facts;
use crate::family::{Family, Recognized};
use crate::yaml::{Data, Node};

/// Reader of kinfer bundles.
#[derive(Debug)]
pub(super) struct Kinfer;

/// Key of the metadata that holds all of it as JSON.
const KEY: &str = "kinfer_metadata";
/// Keys of older files' metadata, which has each as a text by itself.
const OLD_KEYS: [&str; 3] = ["sim_dt", "sim_decimation", "num_actions"];

/// Keys of an ONNX file's metadata that its graph computes (sim/model_export.py:181-225), and those of the simulation and
/// of the joints' controller, which the application keeps. An archive has none of them.
const IN_GRAPH: [&str; 10] = [
    "action_scale",
    "lin_vel_scale",
    "ang_vel_scale",
    "quat_scale",
    "dof_pos_scale",
    "dof_vel_scale",
    "frame_stack",
    "clip_observations",
    "clip_actions",
    "cycle_time",
];
const OF_APPLICATION: [&str; 6] =
    ["use_projected_gravity", "embodiment", "num_parameters", "robot_effort", "tau_factor", "input_params"];

impl Family for Kinfer {
    fn profile(&self) -> &str {
        include_str!("kinfer/profile.toml")
    }

    fn recognize(&self, bundle: &Bundle) -> Result<Option<Recognized>> {
        let mut files: Vec<&str> = bundle.with_ending("kinfer").collect();
        if files.is_empty() {
            // Files of other families that cannot be read are their readers' concern.
            let of_family = |file: &&str| {
                let signature = bundle.signature(file);
                signature.is_ok_and(|signature| signature.metadata.contains_key(KEY))
            };
            files = bundle.with_ending("onnx").filter(of_family).collect();
        }
        let file = match files[..] {
            [] => return Ok(None),
            [file] => file,
            _ => bail!("several policies: {}; name one of them, or the folder of one", files.join(", ")),
        };
        if let Some(found) = packed::recognize(bundle, file)? {
            return Ok(Some(found));
        }
        let signature = bundle.signature(file)?;
        let mut others = Vec::new();
        for file in bundle.with_ending("xml") {
            if Robot::is_one(&bundle.text(file)?) {
                others.push(file.to_owned());
            }
        }
        let document = metadata(file, &signature.metadata)?;
        Ok(Some(Recognized { documents: vec![document], networks: vec![file.to_owned()], others }))
    }

    fn read(&self, bundle: &Bundle, found: &Recognized, facts: &mut Facts) -> Result<Description> {
        let (meta, file) = (&found.documents[0], &found.networks[0]);
        if file.ends_with(packed::STEP) {
            return packed::read(bundle, found, facts);
        }
        let graph = Graph::of(file, bundle.signature(file)?)?;
        graph.check_names(meta)?;
        for key in IN_GRAPH.iter().chain(&OF_APPLICATION) {
            meta.node(key);
        }
        let (dt, decimation) = (meta.number("sim_dt")?, meta.number("sim_decimation")?);
        let period = dt * decimation;
        ensure!(
            dt > 0.0 && decimation >= 1.0 && (1e-6..1e6).contains(&period),
            "{}: sim_dt = {dt} and sim_decimation = {decimation} give a tick of {period} s",
            meta.file
        );
        let mut parts = Parts::new("policy", rounded(1.0 / period));
        facts.note("rate_hz", format!("{}; {}", meta.location("sim_dt"), meta.location("sim_decimation")));

        let outputs = Outputs::of(&graph, facts)?;
        let n = graph.output(&outputs.action)?;
        let given = meta.number("num_actions")?;
        if given != n as f64 {
            return Err(Facts::contradiction(
                "number of actions",
                (&meta.location("num_actions"), &given.to_string()),
                (&format!("{file}: output {:?}", outputs.action), &n.to_string()),
            ));
        }
        let robot = Robot::of(bundle, found, n, facts)?;
        let joints = joint_names(meta, robot.as_ref(), n, facts)?;
        parts.joints("robot", joints.clone());
        let default = default_pose(meta, robot.as_ref(), n, facts)?;
        parts.constant("default", default);

        let network = inputs(&mut parts, &graph, &outputs, n, period, meta, facts)?;
        parts.wired(network);
        parts.act(&format!("policy.{}", outputs.action));

        let relative: bool = facts.value_or_default("target.relative")?;
        let offset = || Op::Add(Operand::Name("default".to_owned()));
        parts.value("target", &format!("policy.{}", outputs.scaled), relative.then(offset).into_iter().collect());
        let scaled = graph.output(&outputs.scaled)?;
        ensure!(scaled == n, "{file}: output {:?} has {scaled} values, and {:?} {n}", outputs.scaled, outputs.action);
        facts.note("target", format!("{}; {}", facts.source("target.output"), facts.source("target.relative")));
        parts.target_joints(TargetKind::Position, "target", "robot");
        if let Some(robot) = robot.filter(|robot| robot.ranges.iter().any(Option::is_some))
            && facts.is_choice("target.limits", "range")?
        {
            let each = |i: usize| {
                let no_limit = [f64::NEG_INFINITY, f64::INFINITY];
                robot.ranges.iter().map(|range| range.unwrap_or(no_limit)[i]).collect()
            };
            parts.limit([each(0), each(1)]);
            facts.note("limits", format!("{}: range of the joints; {}", robot.file, facts.source("target.limits")));
        }
        if let Some(gains) = gains(meta, &joints, facts)? {
            parts.gains(gains);
        }
        Ok(parts.finish())
    }
}

/// Returns the metadata as a document.
fn metadata(file: &str, texts: &BTreeMap<String, String>) -> Result<Document> {
    let parse = |key: &str, text: &str| Node::parse(text).with_context(|| format!("{file}: {}", printable(key)));
    if let Some(text) = texts.get(KEY) {
        let root = parse(KEY, text)?;
        ensure!(matches!(root.data, Data::Map(_)), "{file}: {KEY} must be a JSON object");
        return Ok(Document::of(&format!("{file} {KEY}"), root));
    }
    ensure!(
        OLD_KEYS.iter().all(|key| texts.contains_key(*key)),
        "{file}: its metadata has no {KEY}; export it again with kinfer, or write deploy.toml by docs/DEPLOY.md"
    );
    let entries = texts.iter().map(|(key, text)| Ok((key.clone(), parse(key, text)?)));
    let data = Data::Map(entries.collect::<Result<_>>()?);
    Ok(Document::of(&format!("{file} metadata"), Node { line: 1, data }))
}

/// Returns a rate without the rounding of its period.
fn rounded(rate: f64) -> f64 {
    if (rate - rate.round()).abs() < 1e-9 * rate { rate.round() } else { rate }
}
