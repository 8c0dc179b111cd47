//! LimX's point-foot robots: `params.yaml`, an encoder of the history and a policy.

use actq::error::{Context as _, Result, bail, ensure};

use super::common::action::clip_to;
use super::common::{Histories, Parts, count, given_gravity};
use crate::bundle::Bundle;
use crate::description::{Clock, Description, Gains, Op, Operand, Order, TargetKind, When};
use crate::document::Document;
use crate::facts::Facts;
use crate::family::{Family, Recognized};

/// Reader of LimX bundles.
#[derive(Debug)]
pub(super) struct Limx;

/// The variants, whose networks are in folders of these names.
const VARIANTS: [&str; 2] = ["isaaclab", "isaacgym"];

impl Family for Limx {
    fn profile(&self) -> &str {
        include_str!("limx/profile.toml")
    }

    fn recognize(&self, bundle: &Bundle) -> Result<Option<Recognized>> {
        let Some(file) = bundle.find("params.yaml")? else { return Ok(None) };
        let document = Document::read(bundle, file)?;
        if document.peek("PointfootCfg.joint_names").is_none() {
            return Ok(None);
        }
        let networks: Vec<String> = bundle.with_ending("onnx").map(str::to_owned).collect();
        Ok(Some(Recognized { documents: vec![document], networks, others: Vec::new() }))
    }

    fn read(&self, bundle: &Bundle, found: &Recognized, facts: &mut Facts) -> Result<Description> {
        let yaml = &found.documents[0];
        let variant = variant(&found.networks, facts)?;
        let [encoder, policy] = ["encoder.onnx", "policy.onnx"].map(|name| {
            let ends = |file: &&String| file.ends_with(&format!("{variant}/{name}"));
            found.networks.iter().find(ends).with_context(|| format!("there is no {variant}/{name}"))
        });
        let (encoder, policy) = (encoder?, policy?);

        let key = |path: &str| format!("PointfootCfg.{path}");
        let joints = yaml.texts(&key("joint_names"))?;
        let n = joints.len();
        let initial = initial_pose(yaml, &joints)?;
        refuse_rotated_imu(yaml)?;
        let decimation = yaml.number(&key("control.decimation"))?;
        let rate = yaml.number(&key("loop_frequency"))? / decimation;
        let mut parts = Parts::new("policy", rate);
        facts.note("rate_hz", format!("{} / decimation", yaml.location(&key("loop_frequency"))));
        parts.joints("robot", joints);
        parts.constant("initial", initial);

        let order: Vec<usize> = match variant.as_str() {
            "isaaclab" => facts.value("isaaclab.order")?.unwrap_or_else(|| (0..n).collect()),
            _ => (0..n).collect(),
        };
        ensure!(order.len() == n, "isaaclab.order has {} places, and the file {n} joints", order.len());
        facts.note("joint order", facts.source("isaaclab.order"));
        self.frame(&mut parts, yaml, n, &order, rate, facts)?;
        self.act(&mut parts, yaml, &order, facts)?;
        self.history(&mut parts, yaml, history_length(yaml, n)?, facts)?;
        let latent = parts.network_of("encoder", &port(bundle, encoder)?, encoder, "history");
        parts.values("policy_input", &[&latent, "clipped_frame", "scaled_commands"]);
        facts.note("policy_input", "profile limx (controllers/PointfootController.py:357)");
        let action = parts.network_of("policy", &port(bundle, policy)?, policy, "policy_input");
        parts.act(&action);
        Ok(parts.finish())
    }
}

/// Returns the initial position of each joint.
fn initial_pose(yaml: &Document, joints: &[String]) -> Result<Vec<f64>> {
    let path = |joint: &String| format!("PointfootCfg.init_state.default_joint_angle.{joint}");
    joints.iter().map(|joint| yaml.number(&path(joint))).collect()
}

fn refuse_rotated_imu(yaml: &Document) -> Result<()> {
    for axis in ["roll", "pitch", "yaw"] {
        let path = format!("PointfootCfg.imu_orientation_offset.{axis}");
        let offset = yaml.number(&path)?;
        ensure!(
            offset == 0.0,
            "{} = {offset}: a rotated IMU is not supported; rotate its values first and set 0",
            yaml.location(&path)
        );
    }
    Ok(())
}

/// Returns the number of frames of the history. Refuses other lengths of frames, actions and commands than this
/// reader's.
fn history_length(yaml: &Document, joints: usize) -> Result<usize> {
    let path = |name: &str| format!("PointfootCfg.size.{name}");
    let size = |name: &str| yaml.required(&path(name), "a number of values", count);
    let (frame, length) = (size("observations_size")?, size("obs_history_length")?);
    let ours = 3 + 3 + 3 * joints + 2 + 4;
    ensure!(
        frame == ours,
        "{} = {frame}, but a frame of this family with {joints} joints has {ours} values",
        yaml.location(&path("observations_size"))
    );
    for (name, expected) in [("actions_size", joints), ("commands_size", 3)] {
        let given = size(name)?;
        ensure!(given == expected, "{} = {given}; it must be {expected}", yaml.location(&path(name)));
    }
    yaml.node(&path("encoder_output_size"));
    Ok(length)
}

impl Limx {
    /// Adds the terms of a frame.
    fn frame(
        &self,
        parts: &mut Parts,
        yaml: &Document,
        n: usize,
        order: &[usize],
        rate: f64,
        facts: &mut Facts,
    ) -> Result<()> {
        let scale = |name: &str| yaml.number(&format!("PointfootCfg.normalization.obs_scales.{name}"));
        let scaled = |by: f64| Op::Scale(Operand::Number(by));
        let select = || Op::Select(Order::Places(order.to_vec()));
        parts.raw("gyro", 3, "rad/s");
        parts.value("scaled_gyro", "gyro", vec![scaled(scale("ang_vel")?)]);
        facts.note("scaled_gyro", yaml.location("PointfootCfg.normalization.obs_scales.ang_vel"));
        let (name, len, ops) = given_gravity(facts, "gravity", "wxyz", "quat")?;
        parts.raw(name, len, "");
        parts.value("gravity", name, ops);
        facts.note("gravity", facts.source("gravity"));
        parts.raw_joints("q", "robot", "rad");
        parts.raw_joints("dq", "robot", "rad/s");
        facts.note("relative_q", yaml.location("PointfootCfg.init_state.default_joint_angle"));
        parts.value("relative_q", "q", vec![Op::Subtract(Operand::Name("initial".to_owned()))]);
        parts.value("joint_pos", "relative_q", vec![select(), scaled(scale("dof_pos")?)]);
        facts.note("joint_pos", yaml.location("PointfootCfg.normalization.obs_scales.dof_pos"));
        parts.value("joint_vel", "dq", vec![select(), scaled(scale("dof_vel")?)]);
        facts.note("joint_vel", yaml.location("PointfootCfg.normalization.obs_scales.dof_vel"));
        parts.state("last_action", n, if facts.is_choice("last_action", "raw")? { "ordered" } else { "limited" });
        parts.value("fed_back", "last_action", vec![select()]);
        facts.note("fed_back", facts.source("last_action"));

        let gait: Vec<f64> = facts.value("gait")?.unwrap_or_else(|| vec![0.0; 4]);
        ensure!(gait.len() == 4, "gait has {} values; give frequency, offset, duration and height", gait.len());
        let restarts: bool = facts.value_or_default("clock.restart")?;
        parts.clock(Clock {
            wrap: (!restarts).then_some([0.0, 1.0]),
            restart_above: restarts.then_some(1.0),
            ..Clock::from_zero("gait_phase", gait[0] / rate, When::Before)
        });
        facts.note("gait_phase", format!("{}; {}", facts.source("gait"), facts.source("clock.restart")));
        let turn = || scaled(std::f64::consts::TAU);
        parts.value("gait_sin", "gait_phase", vec![turn(), Op::Sin]);
        parts.value("gait_cos", "gait_phase", vec![turn(), Op::Cos]);
        // A constant is a value that has no input, so it is a state that nothing changes.
        parts.constant_value("gait", gait);
        parts.values(
            "frame",
            &["scaled_gyro", "gravity", "joint_pos", "joint_vel", "fed_back", "gait_sin", "gait_cos", "gait"],
        );
        let commands = ["lin_vel_x", "lin_vel_y", "ang_vel_yaw"]
            .map(|name| yaml.number(&format!("PointfootCfg.user_cmd_scales.{name}")));
        parts.raw("commands", 3, "m/s, m/s, rad/s");
        let commands = commands.into_iter().collect::<Result<Vec<_>>>()?;
        parts.value("scaled_commands", "commands", vec![Op::Scale(Operand::List(commands))]);
        facts.note("scaled_commands", yaml.location("PointfootCfg.user_cmd_scales"));
        Ok(())
    }

    /// Adds the history of `length` frames, and the clipped frame.
    fn history(&self, parts: &mut Parts, yaml: &Document, length: usize, facts: &mut Facts) -> Result<()> {
        let histories = Histories::of(facts)?;
        ensure!(!histories.by_term, "history.layout = \"term\": this family has only \"frame\"");
        let limit = "PointfootCfg.normalization.clip_scales.clip_observations";
        parts.value("clipped_frame", "frame", vec![clip_to(yaml.number(limit)?)]);
        facts.note("clipped_frame", yaml.location(limit));
        facts.note("frame", "profile limx (controllers/PointfootController.py:311-319)");
        let of = if facts.value_or_default::<bool>("history.clipped")? { "clipped_frame" } else { "frame" };
        parts.value("history", of, vec![Op::History(histories.spec(length))]);
        let length = yaml.location("PointfootCfg.size.obs_history_length");
        facts.note("history", format!("{length}; {}", facts.source("history.first")));
        Ok(())
    }

    /// Adds the limits of the action by torque, and the target.
    fn act(&self, parts: &mut Parts, yaml: &Document, order: &[usize], facts: &mut Facts) -> Result<()> {
        let control = |name: &str| yaml.number(&format!("PointfootCfg.control.{name}"));
        let (stiffness, damping) = (control("stiffness")?, control("damping")?);
        let (scale, torque) = (control("action_scale_pos")?, control("user_torque_limit")?);
        let clip = yaml.number("PointfootCfg.normalization.clip_scales.clip_actions")?;
        facts.note("ordered", yaml.location("PointfootCfg.normalization.clip_scales.clip_actions"));
        parts.value("ordered", "policy.ACTION", vec![clip_to(clip), Op::Place(Order::Places(order.to_vec()))]);
        for (name, torque) in [("lowest", -torque), ("highest", torque)] {
            let number = Operand::Number;
            let ops = vec![
                Op::Scale(number(damping)),
                Op::Add(number(torque)),
                Op::Divide(number(stiffness)),
                Op::Add(Operand::Name("relative_q".to_owned())),
                Op::Divide(number(scale)),
            ];
            parts.value(name, "dq", ops);
        }
        let limits = ["lowest", "highest"].map(|name| Operand::Name(name.to_owned()));
        parts.value("limited", "ordered", vec![Op::Clip(limits)]);
        facts.note("limited", format!("{}; {}", yaml.location("PointfootCfg.control"), facts.source("last_action")));
        let ops = vec![Op::Scale(Operand::Number(scale)), Op::Add(Operand::Name("initial".to_owned()))];
        parts.value("target", "limited", ops);
        facts.note("target", yaml.location("PointfootCfg.control.action_scale_pos"));
        parts.target(TargetKind::Position, "target");
        let n = order.len();
        parts.gains(Gains {
            joints: Some("robot".to_owned()),
            stiffness: vec![stiffness; n],
            damping: vec![damping; n],
        });
        facts.note("gains", yaml.location("PointfootCfg.control.stiffness"));
        Ok(())
    }
}

/// Returns the variant: the only one that has networks here, or the answer.
fn variant(networks: &[String], facts: &mut Facts) -> Result<String> {
    let has = |variant: &&str| networks.iter().any(|file| file.contains(&format!("{variant}/policy.onnx")));
    let there: Vec<&str> = VARIANTS.into_iter().filter(has).collect();
    match there[..] {
        [] => bail!("there is no policy.onnx in a folder {}", VARIANTS.join(" or ")),
        [only] => {
            facts.note("variant", format!("the folder {only}"));
            Ok(only.to_owned())
        }
        _ => facts.choose_one_of("variant", &there),
    }
}

/// Returns the only input and output of a file.
fn port(bundle: &Bundle, file: &str) -> Result<(String, String)> {
    let signature = bundle.signature(file)?;
    match (&signature.inputs[..], &signature.outputs[..]) {
        ([(input, _)], [(output, _)]) => Ok((input.clone(), output.clone())),
        (inputs, outputs) => {
            bail!(
                "{file}: {} inputs and {} outputs; one input and one output are supported",
                inputs.len(),
                outputs.len()
            )
        }
    }
}
