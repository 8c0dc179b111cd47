//! The terms of the observation.

use actq::error::{Result, ensure};

use super::super::common::{ACTION, Graph, Histories, Parts, gravity, names};
use super::frames::{MOST, frames};
use super::robot::Robot;
use super::ros::Ros;
use crate::description::{Op, Operand};
use crate::document::Document;
use crate::facts::Facts;
use crate::yaml::Node;

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
pub(super) fn terms(
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
    if facts.chooses("target.base", "current")? || listed.iter().any(|term| matches!(of(term), Term::Position)) {
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
                let is_processed = facts.chooses("last_action", "processed")?;
                source = format!("{source}; {}", facts.source("last_action"));
                parts.state(term, *len, if is_processed { "processed" } else { ACTION })
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
