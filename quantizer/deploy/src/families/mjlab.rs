//! mjlab and its forks: the metadata that the exporter stores in the ONNX file, alone or with the YAML file of a ROS 2
//! node.

use std::collections::BTreeMap;

use actq::error::{Context as _, Result, bail, ensure};
use actq::text::printable;
use actq_onnx::Signature;

use super::common::{Graph, Histories, Parts, gravity, metadata_document, names, numbers};
use crate::bundle::Bundle;
use crate::description::{Description, Gains, Op, Operand, Order, TargetKind};
use crate::document::Document;
use crate::facts::Facts;
use crate::family::{Family, Found};
use crate::yaml::Node;

/// The family.
#[derive(Debug)]
pub(super) struct Mjlab;

/// Keys of the metadata that an export of this family has.
const KEYS: [&str; 4] = ["joint_names", "observation_names", "default_joint_pos", "action_scale"];
/// Key that only the ROS 2 node's YAML file has.
const ROS_KEY: &str = "ordered_relevant_joint_names";
/// Largest difference of a number from the metadata's, which has 3 decimals.
const ROUNDING: f64 = 5.1e-4;
/// Most values of a term and most frames of a history.
const MOST: usize = 1 << 16;

impl Family for Mjlab {
    fn profile(&self) -> &'static str {
        include_str!("mjlab/profile.toml")
    }

    fn recognize(&self, bundle: &Bundle) -> Result<Option<Found>> {
        let mut networks = Vec::new();
        for file in bundle.with_ending("onnx") {
            // A file that cannot be read is of no family, or its reader says why.
            let Ok(signature) = Signature::read(&bundle.path(file)?) else { continue };
            if KEYS.iter().all(|key| signature.metadata.contains_key(*key)) {
                networks.push((file, signature.metadata));
            }
        }
        if networks.is_empty() {
            return Ok(None);
        }
        let mut nodes = Vec::new();
        for file in bundle.with_ending("yaml").chain(bundle.with_ending("yml")) {
            if bundle.text(file).is_ok_and(|text| text.contains(ROS_KEY)) {
                let document = Document::read(bundle, file)?;
                nodes.push(RosNode::all(&document)?.into_iter().map(|node| (file, node)).collect::<Vec<_>>());
            }
        }
        let nodes = nodes.concat();
        let pairs = nodes.iter().flat_map(|node| networks.iter().map(move |network| (node, network)));
        let fits = |((_, node), (file, _)): &(&(&str, RosNode), &(&str, _))| {
            file.rsplit('/').next() == node.model.rsplit('/').next()
        };
        let pairs: Vec<_> = pairs.filter(fits).collect();
        let (network, yaml) = match (&pairs[..], &nodes[..], &networks[..]) {
            ([((yaml, _), network)], ..) => (*network, Some(*yaml)),
            ([], [], [only]) => (only, None),
            ([], [(yaml, node), ..], _) => bail!(
                "{yaml}: {}.ros__parameters.model = {:?} is none of the files {}",
                printable(&node.name),
                printable(&node.model),
                networks.iter().map(|(file, _)| *file).collect::<Vec<_>>().join(", ")
            ),
            _ => bail!(
                "several policies of this family: {}; name the folder of one",
                networks.iter().map(|(file, _)| *file).collect::<Vec<_>>().join(", ")
            ),
        };
        let (file, metadata) = network;
        let mut documents = vec![metadata_document(file, metadata)];
        if let Some(yaml) = yaml {
            documents.push(Document::read(bundle, yaml)?);
        }
        Ok(Some(Found { documents, networks: vec![(*file).to_owned()], others: Vec::new() }))
    }

    fn read(&self, bundle: &Bundle, found: &Found, facts: &mut Facts) -> Result<Description> {
        let (meta, file) = (&found.documents[0], &found.networks[0]);
        let graph = Graph::of(file, &Signature::read(&bundle.path(file)?)?)?;
        let node = match found.documents.get(1) {
            None => None,
            Some(yaml) => {
                let fits = |node: &RosNode| file.rsplit('/').next() == node.model.rsplit('/').next();
                let node = RosNode::all(yaml)?.into_iter().find(fits);
                Some((yaml, node.with_context(|| format!("{}: no node's model is {file}", yaml.file))?))
            }
        };
        let ros = node.as_ref().map(|(yaml, node)| Ros { yaml, at: format!("{}.ros__parameters", node.name) });
        let robot = Robot::of(meta, ros.as_ref(), &graph, facts)?;

        let rate = match &ros {
            Some(ros) => {
                let path = ros.path("phase.control_dt");
                let dt = ros.yaml.number(&path)?;
                ensure!((1e-6..1e6).contains(&dt), "{} = {dt}: give the seconds of a tick", ros.yaml.at(&path));
                facts.note("rate_hz", ros.yaml.at(&path));
                1.0 / dt
            }
            None => facts.find("rate_hz")?.unwrap_or(50.0),
        };
        let mut parts = Parts::new("policy", rate);
        robot.describe(&mut parts);
        facts.note("joint order", robot.source.clone());
        facts.note("default", robot.default_source.clone());
        terms(&mut parts, meta, ros.as_ref(), &robot, &graph, facts)?;
        parts.network(file, &graph.input, &graph.output);
        target(&mut parts, &robot, ros.as_ref(), facts)?;
        Ok(parts.finish())
    }
}

/// A node of a ROS 2 parameters file.
#[derive(Clone)]
struct RosNode {
    name: String,
    /// Name of its ONNX file.
    model: String,
}

impl RosNode {
    /// Returns the nodes of a file that have joints of a policy.
    fn all(yaml: &Document) -> Result<Vec<Self>> {
        let mut nodes = Vec::new();
        for name in yaml.keys("") {
            let at = format!("{name}.ros__parameters");
            if yaml.look(&format!("{at}.joints.{ROS_KEY}")).is_some() {
                let model = yaml.need(&format!("{at}.model"), "the name of an ONNX file", Node::text)?;
                nodes.push(Self { name: name.to_owned(), model: model.to_owned() });
            }
        }
        Ok(nodes)
    }
}

/// The ROS 2 node's part of a bundle.
struct Ros<'a> {
    yaml: &'a Document,
    /// Path of its parameters.
    at: String,
}

impl Ros<'_> {
    fn path(&self, key: &str) -> String {
        format!("{}.{key}", self.at)
    }

    /// Returns a list of the joints' numbers, if it is there.
    fn numbers(&self, key: &str, joints: usize) -> Result<Option<Vec<f64>>> {
        let path = self.path(&format!("joints.{key}"));
        let numbers = self.yaml.maybe(&path, "a list of finite numbers", Node::numbers)?;
        if let Some(numbers) = &numbers {
            ensure!(
                numbers.len() == joints,
                "{} has {} values, but {ROS_KEY} {joints} names",
                self.yaml.at(&path),
                numbers.len()
            );
        }
        Ok(numbers)
    }
}

/// Joints with their numbers, in the policy's order.
struct Robot {
    /// Names of all joints in the order of the raw inputs.
    raw: Vec<String>,
    /// Those that the policy observes.
    observed: Vec<String>,
    /// Those that it moves.
    moved: Vec<String>,
    /// Those whose targets are sent.
    sent: Vec<String>,
    /// Numbers of the observed joints.
    default: Vec<f64>,
    signs: Option<Vec<f64>>,
    /// Numbers of the moved joints.
    scale: Vec<f64>,
    gains: Option<[Vec<f64>; 2]>,
    source: String,
    default_source: String,
    scale_source: String,
    gains_source: String,
}

/// Numbers by joint, and where they are.
type ByJoint = (BTreeMap<String, f64>, String);

impl Robot {
    fn of(meta: &Document, ros: Option<&Ros<'_>>, graph: &Graph, facts: &mut Facts) -> Result<Self> {
        let key = "joint_names";
        let raw = names(meta, key)?;
        let mut source = meta.at(key);
        let mut observed = raw.clone();
        let mut listed = Vec::new();
        if let Some(ros) = ros {
            let path = ros.path(&format!("joints.{ROS_KEY}"));
            listed = ros.yaml.texts(&path)?;
            (observed, source) = order(&raw, &meta.at(key), &listed, &ros.yaml.at(&path), facts)?;
        }
        let moved = if observed.len() == graph.actions {
            observed.clone()
        } else {
            if graph.actions > observed.len() {
                return Err(Facts::contradiction(
                    "number of joints",
                    (&source, &format!("{} joints", observed.len())),
                    (&graph.file, &format!("output {:?} has {} values", printable(&graph.output), graph.actions)),
                ));
            }
            let key = "joints.moved";
            let meaning = format!(
                "the policy observes {} joints and moves {}; which ones, in the order of the joints: {}?",
                observed.len(),
                graph.actions,
                observed.join(", ")
            );
            let moved: Option<Vec<String>> = facts.missing(key, &meaning)?;
            let moved = moved.unwrap_or_else(|| observed[..graph.actions].to_vec());
            ensure!(
                moved.len() == graph.actions && moved.iter().all(|joint| observed.contains(joint)),
                "{key}: give {} of the joints {}",
                graph.actions,
                observed.join(", ")
            );
            moved
        };

        // The metadata's numbers.
        let by_name = |key: &str, one: bool| -> Result<Option<ByJoint>> {
            let Some(list) = numbers(meta, key)? else { return Ok(None) };
            let all = match list.len() {
                1 if one => raw.iter().map(|joint| (joint.clone(), list[0])).collect(),
                len if len == raw.len() => raw.iter().cloned().zip(list).collect(),
                len if len == moved.len() => moved.iter().cloned().zip(list).collect(),
                len => {
                    return Err(Facts::contradiction(
                        "number of joints",
                        (&meta.at(key), &format!("{len} values")),
                        (&meta.at("joint_names"), &format!("{} joints, of which {} move", raw.len(), moved.len())),
                    ));
                }
            };
            Ok(Some((all, meta.at(key))))
        };
        // The YAML file's numbers.
        let of_ros = |key: &str| -> Result<Option<ByJoint>> {
            let Some(ros) = ros else { return Ok(None) };
            let list = ros.numbers(key, listed.len())?;
            let at = ros.yaml.at(&ros.path(&format!("joints.{key}")));
            Ok(list.map(|list| (listed.iter().cloned().zip(list).collect(), at)))
        };
        let pair = |own: &str, yaml: &str, one: bool| -> Result<_> { Ok((by_name(own, one)?, of_ros(yaml)?)) };
        let (default, default_source) =
            agreed(pair("default_joint_pos", "walkready_state", false)?, "default_pose", &observed, facts)?
                .with_context(|| format!("{} is missing", meta.at("default_joint_pos")))?;
        let (scale, scale_source) =
            agreed(pair("action_scale", "action_scales", true)?, "action_scale", &moved, facts)?
                .with_context(|| format!("{} is missing", meta.at("action_scale")))?;
        let stiffness = agreed(pair("joint_stiffness", "kp", false)?, "stiffness", &moved, facts)?;
        let damping = agreed(pair("joint_damping", "kd", false)?, "damping", &moved, facts)?;
        let (gains, gains_source) = match (stiffness, damping) {
            (Some((stiffness, first)), Some((damping, second))) => {
                (Some([stiffness, damping]), format!("{first}; {second}"))
            }
            _ => (None, String::new()),
        };

        let signs = of_ros("joint_signs")?;
        let signs = signs.map(|(signs, at)| -> Result<Vec<f64>> {
            let signs: Vec<f64> = observed.iter().filter_map(|joint| signs.get(joint).copied()).collect();
            ensure!(signs.iter().all(|sign| sign.abs() == 1.0), "{at}: give 1 or -1 for each joint");
            Ok(signs)
        });
        let mut left = Vec::new();
        if let Some(ros) = ros {
            let path = ros.path("joints.uncontrolled_joint_names");
            left = ros.yaml.maybe(&path, "a list of names", Node::texts)?.unwrap_or_default();
        }
        let sent: Vec<String> = moved.iter().filter(|joint| !left.contains(joint)).cloned().collect();
        ensure!(!sent.is_empty(), "uncontrolled_joint_names names all joints that the policy moves");
        Ok(Self {
            raw,
            observed,
            moved,
            sent,
            default,
            signs: signs.transpose()?,
            scale,
            gains,
            source,
            default_source,
            scale_source,
            gains_source,
        })
    }

    /// Adds the lists of joints and numbers.
    fn describe(&self, parts: &mut Parts) {
        parts.joints("robot", self.raw.clone());
        let lists = [
            ("policy", &self.observed, &self.raw),
            ("moved", &self.moved, &self.observed),
            ("sent", &self.sent, &self.moved),
        ];
        for (name, list, other) in lists {
            if list != other {
                parts.joints(name, list.clone());
            }
        }
        parts.constant("default", self.default.clone());
        parts.constant("action_scale", self.scale.clone());
        if let Some(signs) = &self.signs {
            parts.constant("signs", signs.clone());
        }
    }

    /// Returns the name of the order of the observed joints.
    fn observed_order(&self) -> &'static str {
        if self.observed == self.raw { "robot" } else { "policy" }
    }

    /// Returns the name of the order of the moved joints.
    fn moved_order(&self) -> &'static str {
        if self.moved == self.observed { self.observed_order() } else { "moved" }
    }

    /// Returns the name of the order of the joints whose targets are sent.
    fn sent_order(&self) -> &'static str {
        if self.sent == self.moved { self.moved_order() } else { "sent" }
    }

    /// Returns the places of the moved joints among the observed ones, or nothing if they are the same.
    fn moved_places(&self) -> Option<Vec<usize>> {
        let place = |joint: &String| self.observed.iter().position(|other| other == joint);
        (self.moved != self.observed).then(|| self.moved.iter().filter_map(place).collect())
    }

    /// Takes a list of the observed joints' numbers for the moved ones.
    fn of_moved(&self, list: &[f64]) -> Vec<f64> {
        match self.moved_places() {
            Some(places) => places.iter().filter_map(|place| list.get(*place).copied()).collect(),
            None => list.to_vec(),
        }
    }

    /// Returns the operations that order a raw input of all joints.
    fn select(&self) -> Vec<Op> {
        let select = || Op::Select(Order::Joints("policy".to_owned()));
        let mut ops: Vec<Op> = (self.observed != self.raw).then(select).into_iter().collect();
        ops.extend(self.signs.is_some().then(|| Op::Scale(Operand::Name("signs".to_owned()))));
        ops
    }
}

/// Returns the policy's order of joints, and where it is. The metadata and the YAML file must agree, or the user decides.
fn order(
    raw: &[String],
    meta: &str,
    listed: &[String],
    yaml: &str,
    facts: &mut Facts,
) -> Result<(Vec<String>, String)> {
    for (i, joint) in listed.iter().enumerate() {
        ensure!(!listed[..i].contains(joint), "{yaml}: {:?} occurs twice", printable(joint));
    }
    if let Some(joint) = listed.iter().find(|joint| !raw.contains(joint)) {
        return Err(Facts::contradiction(
            "names of the joints",
            (yaml, &format!("{:?}", printable(joint))),
            (meta, &raw.join(", ")),
        ));
    }
    ensure!(!listed.is_empty(), "{yaml} has no names");
    let common: Vec<String> = raw.iter().filter(|joint| listed.contains(joint)).cloned().collect();
    let Some(i) = (0..common.len()).find(|&i| common.get(i) != listed.get(i)) else {
        return Ok((common, format!("{yaml}; {meta}")));
    };
    let key = "joints.order";
    match facts.missing::<String>(key, "which order of joints does the network have?")?.as_deref() {
        Some("metadata") => Ok((common, format!("{meta} (answer {key})"))),
        Some("file") => Ok((listed.to_vec(), format!("{yaml} (answer {key})"))),
        Some(other) => bail!("answer {key} = {other:?}: give \"metadata\" or \"file\""),
        None => {
            let shown = |names: &[String]| {
                let name = names.get(i).map(|name| printable(name));
                format!("joint {i} (the first is 0) is {:?}: {}", name.unwrap_or_default(), names.join(", "))
            };
            Err(Facts::contradiction(
                &format!("order of the joints (answer {key} = \"metadata\" or \"file\" to decide)"),
                (meta, &shown(&common)),
                (yaml, &shown(listed)),
            ))
        }
    }
}

/// Returns numbers of some joints, and where they are: the YAML file's, which must be the metadata's, too, or the user
/// decides.
fn agreed(
    pair: (Option<ByJoint>, Option<ByJoint>),
    key: &str,
    joints: &[String],
    facts: &mut Facts,
) -> Result<Option<(Vec<f64>, String)>> {
    let (numbers, source) = match pair {
        (None, None) => return Ok(None),
        (Some(one), None) | (None, Some(one)) => one,
        (Some(own), Some(yaml)) => {
            let differs = |joint: &&String| match (own.0.get(*joint), yaml.0.get(*joint)) {
                (Some(own), Some(yaml)) => (own - yaml).abs() > ROUNDING,
                _ => false,
            };
            match joints.iter().find(differs) {
                None => (yaml.0, format!("{}; {}", yaml.1, own.1)),
                Some(joint) => {
                    let which = facts.missing::<String>(key, "which numbers hold?")?;
                    match which.as_deref() {
                        Some("metadata") => (own.0, format!("{} (answer {key})", own.1)),
                        Some("file") => (yaml.0, format!("{} (answer {key})", yaml.1)),
                        Some(other) => bail!("answer {key} = {other:?}: give \"metadata\" or \"file\""),
                        None => {
                            let shown = |by: &ByJoint| {
                                format!(
                                    "{} for joint {:?}",
                                    by.0.get(joint).copied().unwrap_or_default(),
                                    printable(joint)
                                )
                            };
                            return Err(Facts::contradiction(
                                &format!("{key} (answer {key} = \"metadata\" or \"file\" to decide)"),
                                (&own.1, &shown(&own)),
                                (&yaml.1, &shown(&yaml)),
                            ));
                        }
                    }
                }
            }
        }
    };
    let number = |joint: &String| {
        let number = numbers.get(joint).copied();
        number.with_context(|| format!("{source}: it has no number for joint {:?}", printable(joint)))
    };
    Ok(Some((joints.iter().map(number).collect::<Result<_>>()?, source)))
}

/// What a term is.
enum Term {
    /// A raw input of a length and a unit, by its name with the ROS 2 node.
    Raw(usize, &'static str, &'static str),
    Gravity,
    Position,
    Velocity,
    Action,
    Unknown,
}

/// Adds the terms of the observation.
fn terms(
    parts: &mut Parts,
    meta: &Document,
    ros: Option<&Ros<'_>>,
    robot: &Robot,
    graph: &Graph,
    facts: &mut Facts,
) -> Result<()> {
    let key = "observation_names";
    let listed = names(meta, key)?;
    let commands = command(meta, robot)?;
    let (joints, moved) = (robot.observed.len(), robot.moved.len());
    let of = |term: &str| match term {
        "base_lin_vel" => Term::Raw(3, "m/s", "linear_velocity"),
        "base_ang_vel" | "imu_ang_vel" => Term::Raw(3, "rad/s", "angular_velocity"),
        "projected_gravity" => Term::Gravity,
        "joint_pos" | "joint_pos_rel" => Term::Position,
        "joint_vel" | "joint_vel_rel" => Term::Velocity,
        "actions" | "last_action" | "prev_actions" => Term::Action,
        "command" | "velocity_commands" | "commands" => {
            commands.map_or(Term::Unknown, |(len, unit)| Term::Raw(len, unit, "cmd_vel"))
        }
        "motion_anchor_pos_b" => Term::Raw(3, "m", "motion_anchor_pos_b"),
        "motion_anchor_ori_b" => Term::Raw(6, "", "motion_anchor_ori_b"),
        _ => Term::Unknown,
    };
    let known = |term: &Term| match term {
        Term::Raw(len, ..) => Some(*len),
        Term::Gravity => Some(3),
        Term::Position | Term::Velocity => Some(joints),
        Term::Action => Some(moved),
        Term::Unknown => None,
    };
    // Lengths first: those that nothing states are questions.
    let mut lens = Vec::new();
    let sum: usize = listed.iter().filter_map(|term| known(&of(term))).sum();
    let unknown = listed.iter().filter(|term| known(&of(term)).is_none()).count();
    let mut open = false;
    for term in &listed {
        lens.push(match known(&of(term)) {
            Some(len) => len,
            None => {
                let rest = graph.input_len.saturating_sub(sum);
                let meaning = format!(
                    "the length of term {term:?} is not known to this reader; how many values of it does the application give? ({rest} of the graph's {} values are left for {unknown} such terms, without histories)",
                    graph.input_len
                );
                let len: Option<usize> = facts.missing(&format!("raw.{term}"), &meaning)?;
                open |= len.is_none();
                let len = len.unwrap_or_else(|| (rest / unknown.max(1)).max(1));
                ensure!((1..=MOST).contains(&len), "raw.{term} = {len}: give 1 to {MOST}");
                len
            }
        });
    }
    let frames = frames(meta, graph, &listed, &lens, open, facts)?;

    let plain: Option<bool> = facts.find("terms.plain")?;
    let relative: bool = facts.get("joint_pos.relative")?;
    let (position, velocity) = if ros.is_some() { ("position", "velocity") } else { ("joint_pos", "joint_vel") };
    let base: Option<String> = facts.find("target.base")?;
    if base.as_deref() == Some("current") || listed.iter().any(|term| matches!(of(term), Term::Position)) {
        parts.raw_joints(position, "robot", "rad");
    }
    if listed.iter().any(|term| matches!(of(term), Term::Velocity)) {
        parts.raw_joints(velocity, "robot", "rad/s");
    }
    for ((term, len), length) in listed.iter().zip(&lens).zip(&frames) {
        let mut source = meta.at(key);
        let mut ops = match of(term) {
            Term::Raw(len, unit, name) => parts.input_as(term, if ros.is_some() { name } else { term }, len, unit),
            Term::Gravity => {
                let rule = if ros.is_some() { "ros.gravity" } else { "gravity" };
                let ops = gravity(parts, rule, facts)?;
                source = format!("{source}; {}", facts.source(rule));
                ops
            }
            Term::Position => {
                parts.begin(term, position);
                let mut ops = robot.select();
                ops.extend(relative.then(|| Op::Subtract(Operand::Name("default".to_owned()))));
                source = format!("{source}; {}", facts.source("joint_pos.relative"));
                ops
            }
            Term::Velocity => {
                parts.begin(term, velocity);
                robot.select()
            }
            Term::Action => {
                let which: Option<String> = facts.find("last_action")?;
                source = format!("{source}; {}", facts.source("last_action"));
                let next = match which.as_deref() {
                    Some("raw") | None => "policy.ACTION",
                    Some("processed") => "processed",
                    Some(other) => bail!("last_action = {other:?}: give \"raw\" or \"processed\""),
                };
                parts.state(term, *len, next)
            }
            Term::Unknown => parts.input(term, *len, ""),
        };
        if plain == Some(false) {
            let name = format!("scale.{term}");
            let scale: Option<f64> =
                facts.missing(&name, &format!("by which number is the term {term:?} multiplied?"))?;
            ops.push(Op::Scale(Operand::Number(scale.unwrap_or(1.0))));
            source = format!("{source}; {}", facts.source(&name));
        }
        facts.note(term, source);
        parts.term(ops, *length);
    }
    facts.note("scales of terms", facts.source("terms.plain"));
    let histories = if frames.iter().any(|length| *length > 1) {
        Histories::of(facts)?
    } else {
        Histories { by_term: false, first: Default::default(), fill: Default::default(), stride: 1 }
    };
    parts.observe(&histories)
}

/// Returns the length and unit of the command by its name, or nothing if it is another command.
fn command(meta: &Document, robot: &Robot) -> Result<Option<(usize, &'static str)>> {
    let commands = meta.maybe("command_names", "a text", Node::text)?.unwrap_or_default();
    Ok(match commands.trim() {
        "twist" | "base_velocity" => Some((3, "m/s, m/s, rad/s")),
        // Positions and velocities of all joints in the motion.
        "motion" => Some((2 * robot.raw.len(), "rad, rad/s")),
        _ => None,
    })
}

/// Returns the number of frames of each term, by the length of the graph's input.
fn frames(
    meta: &Document,
    graph: &Graph,
    terms: &[String],
    lens: &[usize],
    open: bool,
    facts: &mut Facts,
) -> Result<Vec<usize>> {
    let sum: usize = lens.iter().sum();
    let all = graph.input_len;
    let one = vec![1; lens.len()];
    if sum == all || (open && sum > all) {
        return Ok(one);
    }
    let key = "history.length";
    let shown = || terms.iter().zip(lens).map(|(term, len)| format!("{term} {len}")).collect::<Vec<_>>().join(", ");
    let meaning = format!(
        "the terms have {sum} values ({}), and the graph's input {:?} {all}; how many frames of each term does it take? Give a list of one number for each term, or one number for all",
        shown(),
        printable(&graph.input)
    );
    if open && !all.is_multiple_of(sum) {
        // The lengths are questions, so this is one later.
        return Ok(one);
    }
    let answer: Option<toml::Value> = facts.missing(key, &meaning)?;
    let Some(answer) = answer else {
        if all.is_multiple_of(sum) {
            return Ok(vec![all / sum; lens.len()]);
        }
        return Err(Facts::contradiction(
            &format!(
                "length of the observation (if it has histories, answer {key} with a list of one number of frames for each term)"
            ),
            (&meta.at("observation_names"), &format!("{sum} values: {}", shown())),
            (&format!("{}: input {:?}", graph.file, printable(&graph.input)), &format!("{all} values")),
        ));
    };
    let count = |value: &toml::Value| value.as_integer().and_then(|n| usize::try_from(n).ok());
    let frames = match &answer {
        toml::Value::Array(list) => list.iter().map(count).collect::<Option<Vec<_>>>(),
        one => count(one).map(|n| vec![n; lens.len()]),
    };
    let frames = frames.filter(|frames| frames.len() == lens.len() && frames.iter().all(|n| (1..=MOST).contains(n)));
    let frames = frames
        .with_context(|| format!("answer {key}: give a number of frames, or a list of {} of them", lens.len()))?;
    let given =
        frames.iter().zip(lens).try_fold(0usize, |sum, (frames, len)| sum.checked_add(frames.checked_mul(*len)?));
    ensure!(
        given == Some(all),
        "answer {key}: it gives {} values, and the graph's input {:?} takes {all} ({})",
        given.map_or_else(|| "too many".to_owned(), |given| given.to_string()),
        printable(&graph.input),
        shown()
    );
    Ok(frames)
}

/// Adds the target: the scaled action, and what it is added to.
fn target(parts: &mut Parts, robot: &Robot, ros: Option<&Ros<'_>>, facts: &mut Facts) -> Result<()> {
    let mut ops = vec![Op::Scale(Operand::Name("action_scale".to_owned()))];
    let base: Option<String> = facts.find("target.base")?;
    match base.as_deref() {
        Some("default") | None => {
            parts.constant("target_default", robot.of_moved(&robot.default));
            ops.push(Op::Add(Operand::Name("target_default".to_owned())));
        }
        Some("current") => {
            let position = if ros.is_some() { "position" } else { "joint_pos" };
            let mut select = robot.select();
            select.extend(robot.moved_places().map(|places| Op::Select(Order::Places(places))));
            parts.value("current", position, select);
            ops.push(Op::Add(Operand::Name("current".to_owned())));
        }
        Some("nothing") => {}
        Some(other) => bail!("target.base = {other:?}: give \"default\", \"current\" or \"nothing\""),
    }
    parts.value("processed", "policy.ACTION", ops);
    let mut ops = Vec::new();
    if let Some(signs) = &robot.signs {
        ops.push(Op::Scale(Operand::List(robot.of_moved(signs))));
    }
    if robot.sent != robot.moved {
        let place = |joint: &String| robot.moved.iter().position(|other| other == joint);
        ops.push(Op::Select(Order::Places(robot.sent.iter().filter_map(place).collect())));
    }
    parts.value("target", "processed", ops);
    facts.note("target", format!("{}; {}", robot.scale_source, facts.source("target.base")));
    parts.target_joints(TargetKind::Position, "target", robot.sent_order());
    if let Some([stiffness, damping]) = robot.gains.clone() {
        parts.gains(Gains { joints: Some(robot.moved_order().to_owned()), stiffness, damping });
        facts.note("gains", robot.gains_source.clone());
    }
    Ok(())
}
