//! K-Scale's `.kinfer` files: an ONNX graph with `kinfer_metadata`, which assembles the observation and its history
//! itself, beside the robot's MuJoCo file.

use std::collections::BTreeMap;

use actq::error::{Context as _, Error, Result, bail, ensure};
use actq::text::printable;
use actq_onnx::Signature;
use roxmltree::{Node as Element, ParsingOptions};
use serde::Deserialize;

use super::common::{Parts, given_gravity};
use crate::bundle::Bundle;
use crate::description::{Clock, Description, Gains, Network, Numbers, Op, Operand, TargetKind, When};
use crate::document::Document;
use crate::facts::Facts;
use crate::family::{Family, Found};
use crate::yaml::{Data, Node};

/// The family.
#[derive(Debug)]
pub(super) struct Kinfer;

/// Key of the metadata that holds all of it as JSON.
const KEY: &str = "kinfer_metadata";
/// Keys of older files' metadata, which has each as a text by itself.
const OLD_KEYS: [&str; 3] = ["sim_dt", "sim_decimation", "num_actions"];
/// Most elements and attributes of a MuJoCo file.
const MOST_XML_NODES: u32 = 100_000;
/// Most levels of its bodies.
const MOST_XML_LEVELS: usize = 256;
/// Names of the input with the history.
const BUFFERS: [&str; 2] = ["buffer", "hist_obs"];

impl Family for Kinfer {
    fn profile(&self) -> &'static str {
        include_str!("kinfer/profile.toml")
    }

    fn recognize(&self, bundle: &Bundle) -> Result<Option<Found>> {
        let mut files: Vec<&str> = bundle.with_ending("kinfer").collect();
        if files.is_empty() {
            // Files of other families that cannot be read are their readers' concern.
            let of_family = |file: &&str| {
                let signature = bundle.path(file).and_then(|path| Signature::read(&path));
                signature.is_ok_and(|signature| signature.metadata.contains_key(KEY))
            };
            files = bundle.with_ending("onnx").filter(of_family).collect();
        }
        let file = match files[..] {
            [] => return Ok(None),
            [file] => file,
            _ => bail!("several policies: {}; name one of them, or the folder of one", files.join(", ")),
        };
        let signature = Signature::read(&bundle.path(file)?)?;
        let mut others = Vec::new();
        for file in bundle.with_ending("xml") {
            if Robot::is_one(&bundle.text(file)?) {
                others.push(file.to_owned());
            }
        }
        let document = metadata(file, &signature.metadata)?;
        Ok(Some(Found { documents: vec![document], networks: vec![file.to_owned()], others }))
    }

    fn read(&self, bundle: &Bundle, found: &Found, facts: &mut Facts) -> Result<Description> {
        let (meta, file) = (&found.documents[0], &found.networks[0]);
        let graph = Graph::of(file, Signature::read(&bundle.path(file)?)?)?;
        graph.check_names(meta)?;
        let (dt, decimation) = (meta.number("sim_dt")?, meta.number("sim_decimation")?);
        let period = dt * decimation;
        ensure!(
            dt > 0.0 && decimation >= 1.0 && (1e-6..1e6).contains(&period),
            "{}: sim_dt = {dt} and sim_decimation = {decimation} give a tick of {period} s",
            meta.file
        );
        let mut parts = Parts::new("policy", rounded(1.0 / period));
        facts.note("rate_hz", format!("{}; {}", meta.at("sim_dt"), meta.at("sim_decimation")));

        let outputs = Outputs::of(&graph, facts)?;
        let n = graph.output(&outputs.action)?;
        let given = meta.number("num_actions")?;
        if given != n as f64 {
            return Err(Facts::contradiction(
                "number of actions",
                (&meta.at("num_actions"), &given.to_string()),
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

        let relative: bool = facts.get("target.relative")?;
        let offset = || Op::Add(Operand::Name("default".to_owned()));
        parts.value("target", &format!("policy.{}", outputs.scaled), relative.then(offset).into_iter().collect());
        let scaled = graph.output(&outputs.scaled)?;
        ensure!(scaled == n, "{file}: output {:?} has {scaled} values, and {:?} {n}", outputs.scaled, outputs.action);
        facts.note("target", format!("{}; {}", facts.source("target.output"), facts.source("target.relative")));
        parts.target_joints(TargetKind::Position, "target", "robot");
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

/// Returns a name of TorchScript without its number: `t` of `t.1`.
fn base(name: &str) -> &str {
    match name.rsplit_once('.') {
        Some((base, number)) if !base.is_empty() && number.bytes().all(|b| b.is_ascii_digit()) => base,
        _ => name,
    }
}

/// Inputs and outputs of the graph with their lengths.
struct Graph {
    file: String,
    inputs: Vec<(String, usize)>,
    outputs: Vec<(String, usize)>,
}

impl Graph {
    fn of(file: &str, signature: Signature) -> Result<Self> {
        let known = |ports: Vec<(String, Option<usize>)>| {
            let known = |(name, len): (String, Option<usize>)| {
                let len = len.filter(|len| *len > 0);
                let len = len.with_context(|| format!("{file}: the length of {:?} is not given", printable(&name)))?;
                Ok((name, len))
            };
            ports.into_iter().map(known).collect::<Result<Vec<_>>>()
        };
        let graph =
            Self { file: file.to_owned(), inputs: known(signature.inputs)?, outputs: known(signature.outputs)? };
        for (i, (name, _)) in graph.inputs.iter().enumerate() {
            ensure!(
                graph.inputs[..i].iter().all(|(other, _)| base(other) != base(name)),
                "{file}: several inputs are called {:?}",
                printable(base(name))
            );
        }
        Ok(graph)
    }

    /// Compares the inputs with those that the metadata names.
    fn check_names(&self, meta: &Document) -> Result<()> {
        let named = meta.keys("input_params");
        let here: Vec<&str> = self.inputs.iter().map(|(name, _)| base(name)).collect();
        if named.is_empty() || (named.len() == here.len() && named.iter().all(|name| here.contains(name))) {
            return Ok(());
        }
        Err(Facts::contradiction(
            "inputs",
            (&meta.at("input_params"), &named.join(", ")),
            (&self.file, &here.join(", ")),
        ))
    }

    fn has_input(&self, name: &str) -> bool {
        self.inputs.iter().any(|(input, _)| base(input) == name)
    }

    /// Returns the length of an output.
    fn output(&self, name: &str) -> Result<usize> {
        let output = self.outputs.iter().find(|(output, _)| output == name);
        let named = || format!("{}: it has no output {:?}; it has {}", self.file, printable(name), self.listed());
        output.map(|(_, len)| *len).with_context(named)
    }

    fn listed(&self) -> String {
        let shown = |(name, len): &(String, usize)| format!("{} [{len}]", printable(name));
        self.outputs.iter().map(shown).collect::<Vec<_>>().join(", ")
    }
}

/// A name, or several in order of preference.
#[derive(Deserialize)]
#[serde(untagged)]
enum Choice {
    One(String),
    First(Vec<String>),
}

/// What the outputs are.
struct Outputs {
    action: String,
    scaled: String,
    /// The buffer of the next tick, if the graph has one.
    buffer: Option<String>,
}

impl Outputs {
    fn of(graph: &Graph, facts: &mut Facts) -> Result<Self> {
        let action = Self::choose(graph, "states.prev_actions", facts)?;
        let scaled = Self::choose(graph, "target.output", facts)?;
        let buffer = graph.inputs.iter().find(|(name, _)| BUFFERS.contains(&base(name)));
        let Some((input, len)) = buffer else { return Ok(Self { action, scaled, buffer: None }) };
        let key = "states.buffer";
        let by_length = |(name, other): &&(String, usize)| other == len && *name != action && *name != scaled;
        let candidates: Vec<&str> = graph.outputs.iter().filter(by_length).map(|(name, _)| name.as_str()).collect();
        let buffer = match (facts.find::<String>(key)?.as_deref(), &candidates[..]) {
            (Some("by length"), [only]) => Some((*only).to_owned()),
            (Some("by length"), []) => bail!(
                "{}: the input {:?} has {len} values, and no other output has that length ({}); its next value is lost",
                graph.file,
                printable(input),
                graph.listed()
            ),
            (Some("by length"), several) => {
                let meaning = format!(
                    "several outputs have the length {len} of the input {:?} ({}); which of them is its next value?",
                    printable(input),
                    several.join(", ")
                );
                let answer = facts.missing::<String>(key, &meaning)?;
                ensure!(answer.is_none(), "{key}: {meaning}");
                Some(several[0].to_owned())
            }
            (Some(name), _) => {
                let given = graph.output(name)?;
                ensure!(
                    given == *len,
                    "{key} = {name:?} has {given} values, and the input {:?} of {} takes {len}",
                    printable(input),
                    graph.file
                );
                Some(name.to_owned())
            }
            // A question; any output stands for the answer.
            (None, candidates) => Some(candidates.first().map_or_else(|| action.clone(), |name| (*name).to_owned())),
        };
        Ok(Self { action, scaled, buffer })
    }

    /// Returns the output that a rule names, or asks for it.
    fn choose(graph: &Graph, key: &str, facts: &mut Facts) -> Result<String> {
        let has = |name: &&String| graph.outputs.iter().any(|(output, _)| output == *name);
        let first = graph.outputs.first().with_context(|| format!("{}: it has no outputs", graph.file))?;
        match facts.find::<Choice>(key)? {
            None => Ok(first.0.clone()),
            Some(Choice::One(name)) => graph.output(&name).map(|_| name),
            Some(Choice::First(names)) => {
                if let Some(name) = names.iter().find(has) {
                    return Ok(name.clone());
                }
                let meaning =
                    format!("the graph has no output {}; which one is it: {}?", names.join(" or "), graph.listed());
                facts.missing::<String>(key, &meaning)?;
                Ok(first.0.clone())
            }
        }
    }
}

/// Adds the values of the graph's inputs; returns the network that reads them.
fn inputs(
    parts: &mut Parts,
    graph: &Graph,
    outputs: &Outputs,
    n: usize,
    period: f64,
    meta: &Document,
    facts: &mut Facts,
) -> Result<Network> {
    let mut network =
        Network { name: "policy".to_owned(), file: graph.file.clone(), inputs: [].into(), states: [].into() };
    for (input, len) in &graph.inputs {
        let (name, len) = (base(input), *len);
        let at = format!("{}: input {input:?}", graph.file);
        let needed = match name {
            "x_vel" | "y_vel" | "rot" | "t" | "timestamp" => Some(1),
            "vector_command" | "projected_gravity" | "imu_ang_vel" | "imu_euler_xyz" | "imu_lin_acc" => Some(3),
            "dof_pos" | "dof_vel" | "prev_actions" => Some(n),
            _ => None,
        };
        if let Some(needed) = needed {
            ensure!(len == needed, "{at} has {len} values, and {needed} are known with {n} joints");
        }
        let mut source = at.clone();
        let value = match name {
            "x_vel" | "y_vel" => raw(parts, name, len, "m/s"),
            "rot" | "imu_ang_vel" => raw(parts, name, len, "rad/s"),
            "vector_command" => raw(parts, name, len, "m/s, m/s, rad/s"),
            "imu_euler_xyz" => raw(parts, name, len, "rad"),
            "imu_lin_acc" => raw(parts, name, len, "m/s2"),
            "t" | "timestamp" => {
                let clock: Option<String> = facts.find("clock")?;
                source = format!("{}; {}", meta.at("sim_dt"), facts.source("clock"));
                match clock.as_deref() {
                    Some("raw") => raw(parts, name, 1, "s"),
                    Some("count") | None => {
                        parts.clock(Clock {
                            name: name.to_owned(),
                            start: vec![0.0],
                            advance: period,
                            when: When::After,
                            wrap: None,
                            restart_above: None,
                            standing: None,
                        });
                        name.to_owned()
                    }
                    Some(other) => bail!("clock = {other:?}: give \"count\" or \"raw\""),
                }
            }
            "dof_pos" => {
                parts.raw_joints(name, "robot", "rad");
                let relative: bool = facts.get("dof_pos.relative")?;
                source = format!("{at}; {}", facts.source("dof_pos.relative"));
                if relative {
                    parts.value("relative_dof_pos", name, vec![Op::Subtract(Operand::Name("default".to_owned()))]);
                    "relative_dof_pos".to_owned()
                } else {
                    name.to_owned()
                }
            }
            "dof_vel" => {
                parts.raw_joints(name, "robot", "rad/s");
                name.to_owned()
            }
            "projected_gravity" => {
                let (value, from) = gravity(parts, facts)?;
                source = format!("{at}; {from}");
                value
            }
            "prev_actions" => {
                facts.note(name, facts.source("states.prev_actions"));
                state(parts, &mut network, (input, len), &outputs.action, facts)?;
                continue;
            }
            _ if BUFFERS.contains(&name) => {
                let given = meta.maybe("num_observations", "a number", Node::number)?;
                if let Some(given) = given.filter(|given| *given != len as f64) {
                    return Err(Facts::contradiction(
                        "length of the history",
                        (&meta.at("num_observations"), &given.to_string()),
                        (&at, &len.to_string()),
                    ));
                }
                let next = outputs.buffer.clone().unwrap_or_default();
                facts.note(name, format!("output {next:?} by {}", facts.source("states.buffer")));
                state(parts, &mut network, (input, len), &next, facts)?;
                continue;
            }
            _ => {
                // What it is only the application's code says, so it is an input under its own name.
                facts.of_application(
                    &format!("raw.{name}"),
                    &format!("the input {input:?} is not known to this reader; does the application compute its {len} values (true)?"),
                )?;
                raw(parts, &name.replace('.', "_"), len, "")
            }
        };
        facts.note(name, source);
        network.inputs.insert(input.clone(), value);
    }
    if !BUFFERS.iter().any(|name| graph.has_input(name)) {
        meta.get("num_observations");
    }
    Ok(network)
}

/// Adds a raw input; returns its name.
fn raw(parts: &mut Parts, name: &str, len: usize, unit: &str) -> String {
    parts.raw(name, len, unit);
    name.to_owned()
}

/// Makes an input a state that takes an output of the tick before.
fn state(
    parts: &mut Parts,
    network: &mut Network,
    (input, len): (&str, usize),
    output: &str,
    facts: &mut Facts,
) -> Result<()> {
    let start: f64 = facts.get("states.start")?;
    if start == 0.0 {
        network.states.insert(input.to_owned(), output.to_owned());
    } else {
        let name = base(input).replace('.', "_");
        parts.kept_from(&name, len, Numbers::All(start), &format!("policy.{output}"));
        network.inputs.insert(input.to_owned(), name);
    }
    Ok(())
}

/// Adds the direction of gravity; returns the name of its value, and its source.
fn gravity(parts: &mut Parts, facts: &mut Facts) -> Result<(String, String)> {
    let (name, len, ops) = given_gravity(facts, "gravity", "vector", "orientation")?;
    let source = facts.source("gravity");
    if ops.is_empty() {
        return Ok((raw(parts, name, len, ""), source));
    }
    parts.raw(name, len, "");
    parts.value("projected_gravity", name, ops);
    Ok(("projected_gravity".to_owned(), source))
}

/// Returns the joints' names: those of the MuJoCo file, or of the metadata.
fn joint_names(meta: &Document, robot: Option<&Robot>, n: usize, facts: &mut Facts) -> Result<Vec<String>> {
    let path = "joint_names";
    let stated = meta.maybe(path, "a list of names", Node::texts)?;
    if let Some(stated) = &stated {
        ensure!(stated.len() == n, "{} has {} names, and there are {n} actions", meta.at(path), stated.len());
    }
    let (names, source) = match (robot, stated) {
        (Some(robot), None) => (robot.joints.clone(), robot.file.clone()),
        (None, Some(stated)) => (stated, meta.at(path)),
        (Some(robot), Some(stated)) => {
            if let Some(i) = (0..n).find(|&i| stated.get(i) != robot.joints.get(i)) {
                let shown = |names: &[String]| {
                    let name = names.get(i).map_or("nothing", String::as_str);
                    format!("joint {i} is {:?}: {}", printable(name), names.join(", "))
                };
                return Err(Facts::contradiction(
                    "order of the joints",
                    (&meta.at(path), &shown(&stated)),
                    (&robot.file, &shown(&robot.joints)),
                ));
            }
            (stated, format!("{}; {}", meta.at(path), robot.file))
        }
        (None, None) => {
            let names: Option<Vec<String>> = facts.missing(
                "joints.names",
                "the bundle has no MuJoCo file (.xml) of the robot; which joints does the policy have, in order?",
            )?;
            let names = names.unwrap_or_else(|| (0..n).map(|i| format!("joint_{i}")).collect());
            ensure!(names.len() == n, "joints.names has {} names, and there are {n} actions", names.len());
            (names, facts.source("joints.names"))
        }
    };
    facts.note("joint order", source);
    Ok(names)
}

/// The rule default_pose.
#[derive(Deserialize)]
#[serde(untagged)]
enum Pose {
    Of(String),
    Numbers(Vec<f64>),
}

/// Returns the default pose.
fn default_pose(meta: &Document, robot: Option<&Robot>, n: usize, facts: &mut Facts) -> Result<Vec<f64>> {
    let key = "default_pose";
    let standing = meta.maybe("default_standing", "numbers", Node::numbers)?;
    let rule: Option<Pose> = facts.find(key)?;
    let (pose, source) = match rule {
        Some(Pose::Numbers(numbers)) => (numbers, facts.source(key)),
        Some(Pose::Of(of)) if of == "default_standing" => {
            let standing = standing.clone().with_context(|| format!("{} is missing", meta.at("default_standing")))?;
            (standing, format!("{}; {}", meta.at("default_standing"), facts.source(key)))
        }
        Some(Pose::Of(of)) if of == "keyframe" => {
            let name: Option<String> = facts.find("keyframe")?;
            let keyframe = match (&name, robot) {
                (Some(name), Some(robot)) => robot.keyframe(name)?,
                _ => None,
            };
            match (keyframe, robot, &name) {
                (Some(pose), Some(robot), Some(name)) => {
                    (pose, format!("{}: keyframe {name:?}; {}", robot.file, facts.source(key)))
                }
                (_, _, None) => (vec![0.0; n], facts.source("keyframe")),
                _ => {
                    // Upstream takes zeros then, and prints so; a person must decide here.
                    let file = robot.map_or("the bundle", |robot| &robot.file);
                    let wanted = name.unwrap_or_default();
                    let meaning = format!(
                        "{file} has no keyframe {wanted:?}, for which upstream's code takes zeros; give the default pose as a list of {n} numbers, or \"default_standing\"",
                    );
                    let pose: Option<Vec<f64>> = facts.missing(key, &meaning)?;
                    (pose.unwrap_or_else(|| vec![0.0; n]), facts.source(key))
                }
            }
        }
        Some(Pose::Of(of)) => bail!("{key} = {of:?}: give \"keyframe\", \"default_standing\" or a list of numbers"),
        None => (vec![0.0; n], facts.source(key)),
    };
    ensure!(pose.len() == n, "the default pose ({source}) has {} values, and there are {n} actions", pose.len());
    let differs = standing.is_some_and(|standing| standing != pose);
    let other =
        if differs { format!(" ({} differs, and is not used)", meta.at("default_standing")) } else { String::new() };
    facts.note("default", format!("{source}{other}"));
    Ok(pose)
}

/// Returns the gains: one for each joint, by the joints' names, or by the rule gains.places.
fn gains(meta: &Document, joints: &[String], facts: &mut Facts) -> Result<Option<Gains>> {
    let mut lists = Vec::new();
    for path in ["robot_stiffness", "robot_damping"] {
        let Some(node) = meta.get(path) else { return Ok(None) };
        // Which joint a gain belongs to is not known before the joints' names are.
        if facts.is_open("joints.names") {
            continue;
        }
        let wrong = || format!("{} must be finite numbers", meta.at(path));
        let kinds: Option<Vec<f64>> = node.entries().iter().map(|(_, kind)| kind.number()).collect();
        let numbers = node.numbers().or(kinds.filter(|kinds| !kinds.is_empty())).with_context(wrong)?;
        let by_name: Option<Vec<f64>> = joints.iter().map(|joint| node.get(joint)?.number()).collect();
        let list = match by_name {
            Some(list) => list,
            None if numbers.len() == joints.len() && node.entries().is_empty() => numbers,
            None => {
                let key = "gains.places";
                let fits = |places: &Vec<usize>| {
                    places.len() == joints.len() && places.iter().all(|place| *place < numbers.len())
                };
                let places: Option<Vec<usize>> = facts.find(key)?;
                let places = match places {
                    Some(places) if !fits(&places) => {
                        let meaning = format!(
                            "{} has {} values for {} joints, for which the family's places do not fit; which of them does each joint take (places from 0)?",
                            meta.at(path),
                            numbers.len(),
                            joints.len()
                        );
                        facts.missing::<Vec<usize>>(key, &meaning)?
                    }
                    other => other,
                };
                if places.as_ref().is_some_and(|places| !fits(places)) {
                    bail!("{key}: give {} places below {}", joints.len(), numbers.len());
                }
                let places = places.unwrap_or_default();
                let taken = places.iter().filter_map(|place| numbers.get(*place).copied()).collect::<Vec<_>>();
                if taken.is_empty() { vec![0.0; joints.len()] } else { taken }
            }
        };
        lists.push(list);
    }
    if lists.is_empty() {
        return Ok(None);
    }
    facts.note("gains", format!("{}; {}", meta.at("robot_stiffness"), meta.at("robot_damping")));
    let [stiffness, damping] = <[Vec<f64>; 2]>::try_from(lists).map_err(|_| Error::input("gains are incomplete"))?;
    Ok(Some(Gains { joints: Some("robot".to_owned()), stiffness, damping }))
}

/// What a MuJoCo file says of the policy's joints.
struct Robot {
    file: String,
    /// Names of the policy's joints, in the order of `qpos`.
    joints: Vec<String>,
    /// Values of `qpos`: 7 of a free joint and 1 of another.
    values: usize,
    /// Values of `qpos` by the keyframe's name.
    keyframes: Vec<(String, Vec<f64>)>,
}

impl Robot {
    /// Returns `true` if a text looks as a MuJoCo file.
    fn is_one(text: &str) -> bool {
        text.contains("<mujoco")
    }

    /// Reads the bundle's file, if it has one.
    fn of(bundle: &Bundle, found: &Found, n: usize, facts: &mut Facts) -> Result<Option<Self>> {
        let file = match &found.others[..] {
            [] => return Ok(None),
            [file] => file,
            several => {
                let meaning = format!("which MuJoCo file is the robot's: {}?", several.join(", "));
                let file: Option<String> = facts.missing("robot.file", &meaning)?;
                let file = file.unwrap_or_else(|| several[0].clone());
                let there = several.iter().find(|other| **other == file);
                there.with_context(|| format!("robot.file = {file:?}: there are {}", several.join(", ")))?
            }
        };
        let mut robot = Self::parse(file, &bundle.text(file)?).with_context(|| file.clone())?;
        let all = robot.joints.len();
        if all < n {
            return Err(Facts::contradiction(
                "number of joints",
                (file, &format!("{all} joints with one axis")),
                (&found.networks[0], &format!("{n} actions")),
            ));
        }
        if all > n {
            let last: Option<bool> = facts.find("joints.last")?;
            ensure!(
                last != Some(false),
                "joints.last = false: {file} has {all} joints for {n} actions, and it is not known which"
            );
            facts.note("joint selection", format!("the last {n} of {all} joints; {}", facts.source("joints.last")));
            robot.joints.drain(..all - n);
        }
        Ok(Some(robot))
    }

    fn parse(file: &str, text: &str) -> Result<Self> {
        let options = ParsingOptions { allow_dtd: false, nodes_limit: MOST_XML_NODES, ..ParsingOptions::default() };
        let document = roxmltree::Document::parse_with_options(text, options)
            .map_err(|error| Error::input(format!("not XML: {}", printable(&error.to_string()))))?;
        let root = document.root_element();
        ensure!(
            root.has_tag_name("mujoco"),
            "it is not a MuJoCo file: its element is <{}>",
            printable(root.tag_name().name())
        );
        for tag in ["include", "replicate", "attach", "composite", "flexcomp"] {
            let element = root.descendants().find(|element| element.has_tag_name(tag));
            if let Some(element) = element {
                let line = document.text_pos_at(element.range().start).row;
                bail!("line {line}: <{tag}> is not supported; save the compiled model with MuJoCo and use that file");
            }
        }
        let mut robot = Self { file: file.to_owned(), joints: Vec::new(), values: 0, keyframes: Vec::new() };
        for worldbody in children(root, "worldbody") {
            robot.body(worldbody, 0)?;
        }
        ensure!(!robot.joints.is_empty(), "it has no joints");
        for key in children(root, "keyframe").flat_map(|keyframe| children(keyframe, "key")) {
            let (Some(name), Some(qpos)) = (key.attribute("name"), key.attribute("qpos")) else { continue };
            let number = |word: &str| word.parse().ok().filter(|number: &f64| number.is_finite());
            let numbers: Option<Vec<f64>> = qpos.split_whitespace().map(number).collect();
            let numbers =
                numbers.with_context(|| format!("keyframe {:?}: qpos must be finite numbers", printable(name)))?;
            robot.keyframes.push((name.to_owned(), numbers));
        }
        Ok(robot)
    }

    /// Adds a body's joints, then those of its bodies, which is MuJoCo's order.
    fn body(&mut self, body: Element<'_, '_>, level: usize) -> Result<()> {
        ensure!(level < MOST_XML_LEVELS, "bodies have more than {MOST_XML_LEVELS} levels");
        let mut bodies = Vec::new();
        self.own(body, level, &mut bodies)?;
        bodies.into_iter().try_for_each(|inner| self.body(inner, level + 1))
    }

    /// Adds the joints of a body or of a frame in it, and collects the bodies.
    fn own<'a, 'i>(&mut self, body: Element<'a, 'i>, level: usize, bodies: &mut Vec<Element<'a, 'i>>) -> Result<()> {
        ensure!(level < MOST_XML_LEVELS, "frames have more than {MOST_XML_LEVELS} levels");
        for element in body.children().filter(Element::is_element) {
            match element.tag_name().name() {
                "freejoint" => self.free()?,
                "joint" => self.joint(element)?,
                "frame" => self.own(element, level + 1, bodies)?,
                "body" => bodies.push(element),
                _ => {}
            }
        }
        Ok(())
    }

    /// Adds a free joint. The policy's joints are the last values of `qpos`, so it must be before them.
    fn free(&mut self) -> Result<()> {
        ensure!(self.joints.is_empty(), "a body with a free joint follows the robot's joints; remove it from the file");
        self.values += 7;
        Ok(())
    }

    fn joint(&mut self, joint: Element<'_, '_>) -> Result<()> {
        let name = joint.attribute("name").unwrap_or_default();
        match joint.attribute("type").unwrap_or("hinge") {
            "free" => self.free()?,
            "hinge" | "slide" => {
                self.values += 1;
                ensure!(!name.is_empty(), "joint {} has no name", self.joints.len());
                self.joints.push(name.to_owned());
            }
            other => bail!("joint {:?}: type {:?} is not supported", printable(name), printable(other)),
        }
        Ok(())
    }

    /// Returns the policy's joints in a keyframe, which are the last values of its `qpos`.
    fn keyframe(&self, name: &str) -> Result<Option<Vec<f64>>> {
        let Some((_, qpos)) = self.keyframes.iter().find(|(key, _)| key == name) else { return Ok(None) };
        if qpos.len() != self.values {
            return Err(Facts::contradiction(
                "length of qpos",
                (&format!("{}: keyframe {name:?}", self.file), &qpos.len().to_string()),
                (&format!("{}: worldbody", self.file), &format!("{} values of its joints", self.values)),
            ));
        }
        Ok(qpos.len().checked_sub(self.joints.len()).map(|first| qpos[first..].to_vec()))
    }
}

fn children<'a, 'i>(element: Element<'a, 'i>, tag: &'static str) -> impl Iterator<Item = Element<'a, 'i>> {
    element.children().filter(move |child| child.has_tag_name(tag))
}
