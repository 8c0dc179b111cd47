//! unitree_rl_lab: `params/deploy.yaml` beside `exported/policy.onnx`.

use actq::error::{Context as _, Result, bail, ensure};
use actq_onnx::Signature;

use super::common::{Histories, Parts, count, gravity};
use crate::bundle::Bundle;
use crate::description::{Description, Gains, Op, Operand, Order, TargetKind};
use crate::document::Document;
use crate::facts::Facts;
use crate::family::{Family, Found};
use crate::yaml::Node;

/// The family.
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
        let missing: Vec<&str> = KEYS.into_iter().filter(|key| document.look(key).is_none()).collect();
        match missing[..] {
            [] => {}
            [key] => bail!("{}: it looks like a file of unitree_rl_lab, and this key is missing", document.at(key)),
            _ => return Ok(None),
        }
        let network =
            bundle.find("policy.onnx")?.with_context(|| format!("{file}: there is no policy.onnx with it"))?;
        Ok(Some(Found { documents: vec![document], networks: vec![network.to_owned()], others: Vec::new() }))
    }

    fn read(&self, bundle: &Bundle, found: &Found, facts: &mut Facts) -> Result<Description> {
        let (yaml, file) = (&found.documents[0], &found.networks[0]);
        let signature = Signature::read(&bundle.path(file)?)?;
        let mut parts = Parts::new("policy", 1.0 / yaml.number("step_dt")?);
        facts.note("rate_hz", yaml.at("step_dt"));

        let map: Vec<usize> = yaml.need("joint_ids_map", "a list of motor numbers", |node| {
            node.numbers()?.iter().map(|n| place(*n)).collect()
        })?;
        let joints = map.len();
        let motors = map.iter().max().map_or(0, |most| most + 1);
        let mut sorted = map.clone();
        sorted.sort_unstable();
        sorted.dedup();
        ensure!(sorted.len() == joints, "{}: a motor occurs twice", yaml.at("joint_ids_map"));
        ensure!(
            motors == joints,
            "{}: it has {joints} joints of {motors} motors, and a target of some motors is not supported",
            yaml.at("joint_ids_map")
        );
        let default = yaml.numbers("default_joint_pos")?;
        ensure!(
            default.len() == joints,
            "{} has {} values, but joint_ids_map {joints}",
            yaml.at("default_joint_pos"),
            default.len()
        );
        parts.constant("default", default);
        let select = Op::Select(Order::Places(map.clone()));

        let histories = Histories::of(facts)?;
        let clip_first: bool = facts.get("clip_first")?;
        for term in yaml.keys("observations") {
            let path = format!("observations.{term}");
            let ops = match term {
                "base_ang_vel" => parts.input(term, 3, "rad/s"),
                "projected_gravity" => gravity(&mut parts, "gravity", facts)?,
                "velocity_commands" => self.commands(&mut parts, yaml, facts)?,
                "joint_pos_rel" | "joint_pos" => {
                    let mut ops = parts.input_as(term, "joint_pos", joints, "rad");
                    ops.push(select.clone());
                    if term == "joint_pos_rel" {
                        ops.push(Op::Subtract(Operand::Name("default".to_owned())));
                    }
                    ops.extend(chosen_joints(yaml, &path, joints)?);
                    ops
                }
                "joint_vel_rel" | "joint_vel" => {
                    let mut ops = parts.input_as(term, "joint_vel", joints, "rad/s");
                    ops.push(select.clone());
                    ops.extend(chosen_joints(yaml, &path, joints)?);
                    ops
                }
                "last_action" => {
                    let processed = facts.chooses("last_action", "processed")?;
                    parts.state(term, joints, if processed { "processed" } else { "policy.ACTION" })
                }
                other => {
                    // What it is only the application's code says, so it is an input under its own name.
                    let len =
                        yaml.maybe(&format!("{path}.scale"), "a list of numbers", Node::numbers)?.map(|s| s.len());
                    let Some(len) = len else {
                        bail!(
                            "{}: term {other:?} is unknown, and it has no scale that tells its length",
                            yaml.at(&path)
                        );
                    };
                    facts.of_application(
                        &format!("raw.{other}"),
                        &format!("term {other:?} is not known to this reader; does the application compute it (true)?"),
                    )?;
                    parts.input(other, len, "")
                }
            };
            let mut ops = ops;
            let clip = yaml.maybe(&format!("{path}.clip"), "two numbers", Node::pair)?;
            let clip = clip.map(|[low, high]| Op::Clip([Operand::Number(low), Operand::Number(high)]));
            let scale = yaml.maybe(&format!("{path}.scale"), "numbers", Node::one_or_several)?;
            let scale = scale.map(|scale| Op::Scale(Operand::List(scale)));
            let both = if clip_first { [clip, scale] } else { [scale, clip] };
            ops.extend(both.into_iter().flatten());
            let length =
                yaml.maybe(&format!("{path}.history_length"), "a number of frames", count)?.unwrap_or(1).max(1);
            let name = parts.term(ops, length);
            facts.note(&name, yaml.at(&path));
        }
        parts.observe(&histories)?;

        let ([(input, _)], [(output, _)]) = (&signature.inputs[..], &signature.outputs[..]) else {
            bail!(
                "{file}: it has {} inputs and {} outputs; one each is known",
                signature.inputs.len(),
                signature.outputs.len()
            );
        };
        parts.network(file, input, output);
        self.target(&mut parts, yaml, &map, facts)?;
        let order: String = facts.get("gains.order")?;
        let (stiffness, damping) = (yaml.numbers("stiffness")?, yaml.numbers("damping")?);
        let in_motors = |gains: Vec<f64>| -> Result<Vec<f64>> {
            ensure!(gains.len() == joints, "{}: {} gains for {joints} joints", yaml.file, gains.len());
            let mut placed = gains.clone();
            if order == "policy" {
                map.iter().zip(&gains).for_each(|(motor, gain)| placed[*motor] = *gain);
            }
            Ok(placed)
        };
        parts.gains(Gains { joints: None, stiffness: in_motors(stiffness)?, damping: in_motors(damping)? });
        facts.note("gains", format!("{}; {}", yaml.at("stiffness"), facts.source("gains.order")));
        Ok(parts.finish())
    }
}

/// Returns a number of a list of joints or motors as a place.
fn place(number: f64) -> Option<usize> {
    (number >= 0.0 && number.fract() == 0.0).then_some(number as usize)
}

/// The joints that a term names by `params.asset_cfg.joint_ids`, in its order. Upstream takes all where that is no list of
/// numbers (deploy/include/isaaclab/envs/mdp/observations.h).
fn chosen_joints(yaml: &Document, path: &str, joints: usize) -> Result<Option<Op>> {
    let path = format!("{path}.params.asset_cfg.joint_ids");
    let Some(ids) = yaml.get(&path).and_then(Node::numbers).filter(|ids| !ids.is_empty()) else { return Ok(None) };
    let places: Option<Vec<usize>> = ids.iter().map(|id| place(*id).filter(|id| *id < joints)).collect();
    let places = places.with_context(|| format!("{} must be numbers of joints below {joints}", yaml.at(&path)))?;
    Ok(Some(Op::Select(Order::Places(places))))
}

impl UnitreeRlLab {
    fn commands(&self, parts: &mut Parts, yaml: &Document, facts: &mut Facts) -> Result<Vec<Op>> {
        let mut ops = parts.input("velocity_commands", 3, "m/s, m/s, rad/s");
        let path = "commands.base_velocity.ranges";
        if facts.get::<bool>("clamp_commands")? {
            let ranges = ["lin_vel_x", "lin_vel_y", "ang_vel_z"]
                .map(|axis| yaml.need(&format!("{path}.{axis}"), "two numbers", Node::pair));
            let ranges = ranges.into_iter().collect::<Result<Vec<_>>>()?;
            let of = |i: usize| Operand::List(ranges.iter().map(|range| range[i]).collect());
            ops.push(Op::Clip([of(0), of(1)]));
        } else {
            yaml.get(path);
        }
        Ok(ops)
    }

    /// Adds the target: the action, scaled and offset, at the motors.
    fn target(&self, parts: &mut Parts, yaml: &Document, map: &[usize], facts: &mut Facts) -> Result<()> {
        let actions = yaml.keys("actions");
        let [action] = actions[..] else {
            bail!("{} has {} actions; one is known", yaml.at("actions"), actions.len());
        };
        let kind = match action {
            "JointPositionAction" => TargetKind::Position,
            "JointVelocityAction" => TargetKind::Velocity,
            other => bail!("{}: action {other:?} is not known", yaml.at("actions")),
        };
        let path = |key: &str| format!("actions.{action}.{key}");
        let mut ops = Vec::new();
        for (key, op) in [("scale", Op::Scale as fn(Operand) -> Op), ("offset", Op::Add)] {
            if let Some(list) = yaml.maybe(&path(key), "numbers", Node::one_or_several)? {
                ops.push(op(Operand::List(list)));
            }
        }
        if let Some(clip) = yaml.get(&path("clip")) {
            let pairs: Option<Vec<[f64; 2]>> = clip.items().iter().map(Node::pair).collect();
            let pairs = pairs.filter(|pairs| !pairs.is_empty());
            let pairs = pairs.with_context(|| format!("{} must be pairs of numbers", yaml.at(&path("clip"))))?;
            let of = |i: usize| Operand::List(pairs.iter().map(|pair| pair[i]).collect());
            ops.push(Op::Clip([of(0), of(1)]));
        }
        parts.value("processed", "policy.ACTION", ops);
        parts.value("target", "processed", vec![Op::Place(Order::Places(map.to_vec()))]);
        facts.note("processed", yaml.at(&format!("actions.{action}")));
        facts.note("observation", facts.source("history.layout"));
        facts.note("target", format!("{}; {}", yaml.at(&format!("actions.{action}")), yaml.at("joint_ids_map")));
        parts.target(kind, "target");
        Ok(())
    }
}
