//! unitree_rl_lab: `params/deploy.yaml` beside `exported/policy.onnx`.

use actq::error::{Context as _, Result, bail, ensure};

use super::common::{Histories, Parts, count, gravity};
use crate::bundle::Bundle;
use crate::description::{Description, Gains, Op, Operand, Order, TargetKind};
use crate::document::Document;
use crate::facts::Facts;
use crate::family::{Family, Found};
use crate::yaml::Node;

/// Reader of unitree_rl_lab bundles.
#[derive(Debug)]
pub(super) struct UnitreeRlLab;

/// Keys that only this family's file has together.
const KEYS: [&str; 4] = ["joint_ids_map", "step_dt", "actions", "observations"];

impl Family for UnitreeRlLab {
    fn profile(&self) -> &'static str {
        include_str!("unitree_rl_lab/profile.toml")
    }

    fn recognize(&self, bundle: &Bundle) -> Result<Option<Found>> {
        let Some(file) = bundle.find("deploy.yaml")? else { return Ok(None) };
        let document = Document::read(bundle, file)?;
        let missing: Vec<&str> = KEYS.into_iter().filter(|key| document.peek(key).is_none()).collect();
        match missing[..] {
            [] => {}
            [key] => {
                bail!("{}: it looks like a file of unitree_rl_lab, and this key is missing", document.location(key))
            }
            _ => return Ok(None),
        }
        let network =
            bundle.find("policy.onnx")?.with_context(|| format!("{file}: there is no policy.onnx with it"))?;
        Ok(Some(Found { documents: vec![document], networks: vec![network.to_owned()], others: Vec::new() }))
    }

    fn read(&self, bundle: &Bundle, found: &Found, facts: &mut Facts) -> Result<Description> {
        let (yaml, file) = (&found.documents[0], &found.networks[0]);
        let signature = bundle.signature(file)?;
        let mut parts = Parts::new("policy", 1.0 / yaml.number("step_dt")?);
        facts.note("rate_hz", yaml.location("step_dt"));

        let motors = motors(yaml)?;
        let joints = motors.len();
        parts.constant("default", default_pose(yaml, joints)?);
        let mut terms = Terms { yaml, motors: &motors, clip_first: false, parts: &mut parts, facts };
        terms.observe()?;

        let ([(input, _)], [(output, _)]) = (&signature.inputs[..], &signature.outputs[..]) else {
            bail!(
                "{file}: {} inputs and {} outputs; one input and one output are supported",
                signature.inputs.len(),
                signature.outputs.len()
            );
        };
        parts.network(file, input, output);
        target(&mut parts, yaml, &motors, facts)?;
        parts.gains(gains(yaml, &motors, facts)?);
        facts.note("gains", format!("{}; {}", yaml.location("stiffness"), facts.source("gains.order")));
        Ok(parts.finish())
    }
}

/// Returns the motor of each joint.
fn motors(yaml: &Document) -> Result<Vec<usize>> {
    let key = "joint_ids_map";
    let motors: Vec<usize> = yaml.required(key, "a list of motor numbers", |node| {
        node.numbers()?.iter().map(|number| place(*number)).collect()
    })?;
    let joints = motors.len();
    let count = motors.iter().max().map_or(0, |most| most + 1);
    let mut sorted = motors.clone();
    sorted.sort_unstable();
    sorted.dedup();
    ensure!(sorted.len() == joints, "{}: a motor occurs twice", yaml.location(key));
    ensure!(
        count == joints,
        "{}: it has {joints} joints of {count} motors, and a target of some motors is not supported",
        yaml.location(key)
    );
    Ok(motors)
}

fn default_pose(yaml: &Document, joints: usize) -> Result<Vec<f64>> {
    let key = "default_joint_pos";
    let default = yaml.numbers(key)?;
    ensure!(default.len() == joints, "{} has {} values, but joint_ids_map {joints}", yaml.location(key), default.len());
    Ok(default)
}

/// Returns the gains in the order of the motors.
fn gains(yaml: &Document, motors: &[usize], facts: &mut Facts) -> Result<Gains> {
    let order: String = facts.value_or_default("gains.order")?;
    let (stiffness, damping) = (yaml.numbers("stiffness")?, yaml.numbers("damping")?);
    let in_motors = |gains: Vec<f64>| -> Result<Vec<f64>> {
        ensure!(gains.len() == motors.len(), "{}: {} gains for {} joints", yaml.file, gains.len(), motors.len());
        let mut placed = gains.clone();
        if order == "policy" {
            motors.iter().zip(&gains).for_each(|(motor, gain)| placed[*motor] = *gain);
        }
        Ok(placed)
    };
    Ok(Gains { joints: None, stiffness: in_motors(stiffness)?, damping: in_motors(damping)? })
}

/// The terms of the observation under construction.
struct Terms<'a> {
    yaml: &'a Document,
    /// Motor of each joint.
    motors: &'a [usize],
    /// `true` if a term is clipped before it is scaled.
    clip_first: bool,
    parts: &'a mut Parts,
    facts: &'a mut Facts,
}

impl Terms<'_> {
    /// Adds all terms, and the observation.
    fn observe(&mut self) -> Result<()> {
        let histories = Histories::of(self.facts)?;
        self.clip_first = self.facts.value_or_default("clip_first")?;
        for name in self.yaml.keys("observations") {
            self.add(name)?;
        }
        self.parts.observe(&histories)
    }

    /// Adds a term with its clip, scale and history.
    fn add(&mut self, name: &str) -> Result<()> {
        let yaml = self.yaml;
        let path = format!("observations.{name}");
        let mut ops = self.begin(name, &path)?;
        let clip = yaml.optional(&format!("{path}.clip"), "two numbers", Node::pair)?;
        let clip = clip.map(|[low, high]| Op::Clip([Operand::Number(low), Operand::Number(high)]));
        let scale = yaml.optional(&format!("{path}.scale"), "numbers", Node::one_or_several)?;
        let scale = scale.map(|scale| Op::Scale(Operand::List(scale)));
        let both = if self.clip_first { [clip, scale] } else { [scale, clip] };
        ops.extend(both.into_iter().flatten());
        let length = yaml.optional(&format!("{path}.history_length"), "a number of frames", count)?.unwrap_or(1).max(1);
        let value = self.parts.term(ops, length);
        self.facts.note(&value, yaml.location(&path));
        Ok(())
    }

    /// Begins a term; returns the operations on its raw input.
    fn begin(&mut self, name: &str, path: &str) -> Result<Vec<Op>> {
        let joints = self.motors.len();
        let select = || Op::Select(Order::Places(self.motors.to_vec()));
        Ok(match name {
            "base_ang_vel" => self.parts.input(name, 3, "rad/s"),
            "projected_gravity" => gravity(self.parts, "gravity", self.facts)?,
            "velocity_commands" => self.commands()?,
            "joint_pos_rel" | "joint_pos" => {
                let mut ops = self.parts.input_as(name, "joint_pos", joints, "rad");
                ops.push(select());
                if name == "joint_pos_rel" {
                    ops.push(Op::Subtract(Operand::Name("default".to_owned())));
                }
                ops.extend(chosen_joints(self.yaml, path, joints)?);
                ops
            }
            "joint_vel_rel" | "joint_vel" => {
                let mut ops = self.parts.input_as(name, "joint_vel", joints, "rad/s");
                ops.push(select());
                ops.extend(chosen_joints(self.yaml, path, joints)?);
                ops
            }
            "last_action" => {
                let processed = self.facts.is_choice("last_action", "processed")?;
                self.parts.state(name, joints, if processed { "processed" } else { "policy.ACTION" })
            }
            other => self.unknown(other, path)?,
        })
    }

    /// Begins a term of another name. Only the application knows this term, so it becomes a raw input.
    fn unknown(&mut self, name: &str, path: &str) -> Result<Vec<Op>> {
        let scale = self.yaml.optional(&format!("{path}.scale"), "a list of numbers", Node::numbers)?;
        let Some(scale) = scale else {
            bail!(
                "{}: term {name:?} is unknown; give it a scale with one number for each of its values",
                self.yaml.location(path)
            );
        };
        self.facts.of_application(
            &format!("raw.{name}"),
            &format!("term {name:?} is not known to this reader; does the application compute it (true)?"),
        )?;
        Ok(self.parts.input(name, scale.len(), ""))
    }

    fn commands(&mut self) -> Result<Vec<Op>> {
        let yaml = self.yaml;
        let mut ops = self.parts.input("velocity_commands", 3, "m/s, m/s, rad/s");
        let path = "commands.base_velocity.ranges";
        if self.facts.value_or_default::<bool>("clamp_commands")? {
            let ranges = ["lin_vel_x", "lin_vel_y", "ang_vel_z"]
                .map(|axis| yaml.required(&format!("{path}.{axis}"), "two numbers", Node::pair));
            let ranges = ranges.into_iter().collect::<Result<Vec<_>>>()?;
            let of = |i: usize| Operand::List(ranges.iter().map(|range| range[i]).collect());
            ops.push(Op::Clip([of(0), of(1)]));
        } else {
            yaml.node(path);
        }
        Ok(ops)
    }
}

/// Returns a number of a list of joints or motors as a place.
fn place(number: f64) -> Option<usize> {
    (number >= 0.0 && number.fract() == 0.0).then_some(number as usize)
}

/// The joints that a term names by `params.asset_cfg.joint_ids`, in its order. Upstream takes all where that is no list
/// of numbers (deploy/include/isaaclab/envs/mdp/observations.h).
fn chosen_joints(yaml: &Document, path: &str, joints: usize) -> Result<Option<Op>> {
    let path = format!("{path}.params.asset_cfg.joint_ids");
    let Some(ids) = yaml.node(&path).and_then(Node::numbers).filter(|ids| !ids.is_empty()) else { return Ok(None) };
    let places: Option<Vec<usize>> = ids.iter().map(|id| place(*id).filter(|id| *id < joints)).collect();
    let places =
        places.with_context(|| format!("{} must be numbers of joints below {joints}", yaml.location(&path)))?;
    Ok(Some(Op::Select(Order::Places(places))))
}

/// Adds the target: the action, scaled and offset, at the motors.
fn target(parts: &mut Parts, yaml: &Document, motors: &[usize], facts: &mut Facts) -> Result<()> {
    let actions = yaml.keys("actions");
    let [action] = actions[..] else {
        bail!("{} has {} actions; one is supported", yaml.location("actions"), actions.len());
    };
    let kind = match action {
        "JointPositionAction" => TargetKind::Position,
        "JointVelocityAction" => TargetKind::Velocity,
        other => bail!("{}: action {other:?} is not known", yaml.location("actions")),
    };
    let path = |key: &str| format!("actions.{action}.{key}");
    let mut ops = Vec::new();
    for (key, op) in [("scale", Op::Scale as fn(Operand) -> Op), ("offset", Op::Add)] {
        if let Some(list) = yaml.optional(&path(key), "numbers", Node::one_or_several)? {
            ops.push(op(Operand::List(list)));
        }
    }
    if let Some(clip) = yaml.node(&path("clip")) {
        let pairs: Option<Vec<[f64; 2]>> = clip.items().iter().map(Node::pair).collect();
        let pairs = pairs.filter(|pairs| !pairs.is_empty());
        let pairs = pairs.with_context(|| format!("{} must be pairs of numbers", yaml.location(&path("clip"))))?;
        let of = |i: usize| Operand::List(pairs.iter().map(|pair| pair[i]).collect());
        ops.push(Op::Clip([of(0), of(1)]));
    }
    parts.value("processed", "policy.ACTION", ops);
    parts.value("target", "processed", vec![Op::Place(Order::Places(motors.to_vec()))]);
    facts.note("processed", yaml.location(&format!("actions.{action}")));
    facts.note("observation", facts.source("history.layout"));
    facts
        .note("target", format!("{}; {}", yaml.location(&format!("actions.{action}")), yaml.location("joint_ids_map")));
    parts.target(kind, "target");
    Ok(())
}
