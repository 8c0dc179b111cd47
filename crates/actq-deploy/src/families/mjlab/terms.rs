//! The terms of the observation.

use actq::error::{Result, ensure};

use super::super::common::{ACTION, Graph, Histories, Parts, gravity, names};
use super::frames::{MOST, frames, stated_frames};
use super::robot::Robot;
use super::ros::Ros;
use super::stated::{ROUNDING, Stated};
use crate::description::{Op, Operand};
use crate::document::Document;
use crate::facts::Facts;
use crate::yaml::Node;

/// Key of the terms' names in the metadata.
const NAMES: &str = "observation_names";

/// Kind of a term.
#[derive(Clone, Copy)]
enum Term {
    /// A raw input of a length and a unit, by its name with the ROS 2 node.
    Raw(usize, &'static str, &'static str),
    Gravity,
    Position,
    Velocity,
    Action,
    Unknown,
}

impl Term {
    /// Recognizes a term by its name. `command` is the length and unit of the command, if known.
    fn of(name: &str, command: Option<(usize, &'static str)>) -> Self {
        match name {
            "base_lin_vel" => Self::Raw(3, "m/s", "linear_velocity"),
            "base_ang_vel" | "imu_ang_vel" => Self::Raw(3, "rad/s", "angular_velocity"),
            "projected_gravity" => Self::Gravity,
            "joint_pos" | "joint_pos_rel" => Self::Position,
            "joint_vel" | "joint_vel_rel" => Self::Velocity,
            "actions" | "last_action" | "prev_actions" => Self::Action,
            "command" | "velocity_commands" | "commands" => {
                command.map_or(Self::Unknown, |(len, unit)| Self::Raw(len, unit, "cmd_vel"))
            }
            "motion_anchor_pos_b" => Self::Raw(3, "m", "motion_anchor_pos_b"),
            "motion_anchor_ori_b" => Self::Raw(6, "", "motion_anchor_ori_b"),
            _ => Self::Unknown,
        }
    }

    /// Returns the number of values, if known.
    fn len(self, robot: &Robot) -> Option<usize> {
        match self {
            Self::Raw(len, ..) => Some(len),
            Self::Gravity => Some(3),
            Self::Position | Self::Velocity => Some(robot.observed.len()),
            Self::Action => Some(robot.moved.len()),
            Self::Unknown => None,
        }
    }
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
    let names = names(meta, NAMES)?;
    let command = command(meta, robot)?;
    let terms: Vec<(&str, Term)> = names.iter().map(|name| (name.as_str(), Term::of(name, command))).collect();
    // Lengths first: those that nothing states are questions.
    let (lens, open) = lengths(&terms, robot, graph, facts)?;
    let stated = Stated::of(meta, names.len())?;
    let frames = match &stated.frames {
        Some(given) => stated_frames(meta, graph, given, &names, &lens, open)?,
        None => frames(meta, graph, &names, &lens, open, facts)?,
    };

    let plain: Option<bool> = if stated.scale.is_some() { Some(true) } else { facts.value("terms.plain")? };
    let relative: bool = facts.value_or_default("joint_pos.relative")?;
    let has_ros = ros.is_some();
    let mut builder = Builder { parts, meta, robot, has_ros, relative, facts };
    builder.joint_inputs(&terms)?;
    for (i, ((&(name, term), &len), &length)) in terms.iter().zip(&lens).zip(&frames).enumerate() {
        let (mut ops, mut source) = builder.begin(name, term, len)?;
        ops.extend(stated.ops(i, name));
        if !open && let Some(factors) = stated.constant(meta, i, name, len)? {
            builder.parts.rounded_constant(&format!("scale_{name}"), factors, ROUNDING);
        }
        if plain == Some(false) {
            ops.push(builder.scale(name, &mut source)?);
        }
        builder.facts.note(name, source);
        builder.parts.term(ops, length);
    }
    let of_rule = facts.source("terms.plain");
    facts.note("scales of terms", if stated.scale.is_some() { Stated::source(meta) } else { of_rule });
    let histories = if frames.iter().any(|length| *length > 1) {
        Histories::of(facts)?
    } else {
        Histories { by_term: false, first: Default::default(), fill: Default::default(), stride: 1 }
    };
    parts.observe(&histories)
}

/// Returns the length of each term. `true` if one is still a question; a guess is in its place then.
fn lengths(terms: &[(&str, Term)], robot: &Robot, graph: &Graph, facts: &mut Facts) -> Result<(Vec<usize>, bool)> {
    let known = |(_, term): &(&str, Term)| term.len(robot);
    let unknown = terms.iter().filter(|term| known(term).is_none()).count();
    let rest = graph.input_len.saturating_sub(terms.iter().filter_map(known).sum());
    let (mut lens, mut open) = (Vec::new(), false);
    for term in terms {
        lens.push(match known(term) {
            Some(len) => len,
            None => {
                let name = term.0;
                let meaning = format!(
                    "term {name:?}: unknown length; how many values does the application give? (the graph has {rest} values for {unknown} such terms)"
                );
                let len: Option<usize> = facts.missing(&format!("raw.{name}"), &meaning)?;
                open |= len.is_none();
                let len = len.unwrap_or_else(|| (rest / unknown.max(1)).max(1));
                ensure!((1..=MOST).contains(&len), "raw.{name} = {len}: give 1 to {MOST}");
                len
            }
        });
    }
    Ok((lens, open))
}

/// The terms under construction.
struct Builder<'a> {
    parts: &'a mut Parts,
    meta: &'a Document,
    robot: &'a Robot,
    /// `true` if the values are those of the ROS 2 node.
    has_ros: bool,
    /// `true` if the default is subtracted from the joints' positions.
    relative: bool,
    facts: &'a mut Facts,
}

impl Builder<'_> {
    /// Returns the names of the raw inputs of the joints' positions and velocities.
    fn joint_names(&self) -> (&'static str, &'static str) {
        if self.has_ros { ("position", "velocity") } else { ("joint_pos", "joint_vel") }
    }

    /// Adds the raw inputs of the joints that terms or the target read.
    fn joint_inputs(&mut self, terms: &[(&str, Term)]) -> Result<()> {
        let (position, velocity) = self.joint_names();
        let has = |is_read: fn(&Term) -> bool| terms.iter().any(|(_, term)| is_read(term));
        if self.facts.is_choice("target.base", "current")? || has(|term| matches!(term, Term::Position)) {
            self.parts.raw_joints(position, "robot", "rad");
        }
        if has(|term| matches!(term, Term::Velocity)) {
            self.parts.raw_joints(velocity, "robot", "rad/s");
        }
        Ok(())
    }

    /// Begins a term; returns the operations on its raw input, and where they come from.
    fn begin(&mut self, name: &str, term: Term, len: usize) -> Result<(Vec<Op>, String)> {
        let (position, velocity) = self.joint_names();
        let listed = self.meta.location(NAMES);
        let by_rule = |facts: &Facts, rule: &str| format!("{listed}; {}", facts.source(rule));
        Ok(match term {
            Term::Raw(len, unit, of_ros) => {
                let input = if self.has_ros { of_ros } else { name };
                (self.parts.input_as(name, input, len, unit), listed)
            }
            Term::Gravity => {
                let rule = if self.has_ros { "ros.gravity" } else { "gravity" };
                let ops = gravity(self.parts, rule, self.facts)?;
                (ops, by_rule(self.facts, rule))
            }
            Term::Position => {
                self.parts.begin(name, position);
                let mut ops = self.robot.select();
                ops.extend(self.relative.then(|| Op::Subtract(Operand::Name("default".to_owned()))));
                (ops, by_rule(self.facts, "joint_pos.relative"))
            }
            Term::Velocity => {
                self.parts.begin(name, velocity);
                (self.robot.select(), listed)
            }
            Term::Action => {
                let is_processed = self.facts.is_choice("last_action", "processed")?;
                let ops = self.parts.state_term(name, len, if is_processed { "processed" } else { ACTION });
                (ops, by_rule(self.facts, "last_action"))
            }
            Term::Unknown => (self.parts.input(name, len, ""), listed),
        })
    }

    /// Asks for the scale of a term, and adds its source.
    fn scale(&mut self, name: &str, source: &mut String) -> Result<Op> {
        let key = format!("scale.{name}");
        let meaning = format!("by which number is the term {name:?} multiplied?");
        let scale: Option<f64> = self.facts.missing(&key, &meaning)?;
        *source = format!("{source}; {}", self.facts.source(&key));
        Ok(Op::Scale(Operand::Number(scale.unwrap_or(1.0))))
    }
}

/// Returns the length and unit of the command by its name, or nothing if it is another command.
fn command(meta: &Document, robot: &Robot) -> Result<Option<(usize, &'static str)>> {
    let commands = meta.optional("command_names", "a text", Node::text)?.unwrap_or_default();
    Ok(match commands.trim() {
        "twist" | "base_velocity" => Some((3, "m/s, m/s, rad/s")),
        // Positions and velocities of all joints in the motion.
        "motion" => Some((2 * robot.raw.len(), "rad, rad/s")),
        _ => None,
    })
}
