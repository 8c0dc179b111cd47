//! A policy as Isaac Lab's files describe it; each file gives some or all of it.

use actq::error::{Result, ensure};

use super::patterns::Joints;

/// Modules whose functions are known: today's name, and that of versions before 2.0.
pub(super) const MODULES: [&str; 2] = ["isaaclab.envs.mdp.", "omni.isaac.lab.envs.mdp."];

/// A policy with what surrounds it.
#[derive(Debug)]
pub(super) struct Policy {
    pub(super) rate: Sourced,
    /// Steps of the simulation in a tick.
    pub(super) decimation: f64,
    /// All joints of the robot, in the simulation's order.
    pub(super) joints: Joints,
    /// Default positions and velocities of all joints.
    pub(super) default: Sourced,
    pub(super) default_velocity: Sourced,
    /// Lowest and highest positions of all joints, if they are given.
    pub(super) limits: Option<[Sourced; 2]>,
    /// Stiffness and damping of all joints, unless only the robot's USD file has them.
    pub(super) gains: Option<[Sourced; 2]>,
    pub(super) terms: Vec<Term>,
    /// Layout of the terms' histories, if it is given.
    pub(super) layout: Option<Layout>,
    pub(super) actions: Vec<Action>,
}

/// Layout of histories, and the file and key that state it.
#[derive(Debug)]
pub(super) enum Layout {
    /// All frames of a term, then the next term.
    Terms(String),
    /// All terms of a frame, then the next frame.
    Frames(String),
    /// The environment has one, and the file does not state it.
    Left(String),
}

/// Numbers and where they are.
#[derive(Clone, Debug)]
pub(super) struct Sourced {
    pub(super) numbers: Vec<f64>,
    pub(super) from: String,
}

/// A term of the observation.
#[derive(Debug)]
pub(super) struct Term {
    pub(super) name: String,
    /// Module and name of its function, with a point between them.
    pub(super) function: String,
    pub(super) what: TermSource,
    /// Places of its joints, if it is of joints.
    pub(super) joints: Vec<usize>,
    /// Offsets that are subtracted from the joints' values; empty for none.
    pub(super) offset: Vec<f64>,
    pub(super) clip: Option<[f64; 2]>,
    /// One number, or one for each value.
    pub(super) scale: Option<Vec<f64>>,
    pub(super) frames: usize,
    /// Its file and key.
    pub(super) from: String,
}

/// Content of a term.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum TermSource {
    /// A raw input of this name, length and unit.
    Raw(String, usize, &'static str),
    /// A command: a raw input of this name and length, and the ranges of its values, if they are given.
    Command(String, usize, Option<Vec<[f64; 2]>>),
    /// A quaternion, a raw input of this name, whose order differs between releases.
    Quaternion(String),
    /// The direction of gravity in the frame of the robot's root.
    Gravity,
    /// Values of joints: a raw input of this name and unit.
    Joints(&'static str, &'static str),
    /// The action before, or the part of it at these places.
    LastAction(Option<Vec<usize>>),
    /// Something that the application must compute: the reason, and the length, if it is given.
    Unknown(String, Option<usize>),
}

impl Term {
    /// Returns the number of its values in a frame, if it is known.
    pub(super) fn len(&self, actions: usize) -> Option<usize> {
        match &self.what {
            TermSource::Raw(_, len, _) | TermSource::Command(_, len, _) => Some(*len),
            TermSource::Quaternion(_) => Some(4),
            TermSource::Gravity => Some(3),
            TermSource::Joints(..) => Some(self.joints.len()),
            TermSource::LastAction(places) => Some(places.as_ref().map_or(actions, Vec::len)),
            TermSource::Unknown(_, len) => *len,
        }
    }
}

/// Returns the name of a function of Isaac Lab's own observations; `None` for any other function.
pub(super) fn observation(function: &str) -> Option<&str> {
    MODULES.iter().find_map(|module| function.strip_prefix(module)?.strip_prefix("observations."))
}

/// Returns what a function of Isaac Lab's observations gives without parameters of its own, and whether a default is
/// subtracted from it.
pub(super) fn known(function: &str) -> Option<(TermSource, bool)> {
    let raw = |name: &str, len, unit| (TermSource::Raw(name.to_owned(), len, unit), false);
    Some(match observation(function)? {
        "base_pos_z" => raw("base_pos_z", 1, "m"),
        name @ ("base_lin_vel" | "root_lin_vel_w") => raw(name, 3, "m/s"),
        name @ ("base_ang_vel" | "root_ang_vel_w" | "imu_ang_vel") => raw(name, 3, "rad/s"),
        "root_pos_w" => raw("root_pos_w", 3, "m"),
        "imu_lin_acc" => raw("imu_lin_acc", 3, "m/s^2"),
        name @ ("imu_projected_gravity" | "pva_projected_gravity") => raw(name, 3, ""),
        name @ ("root_quat_w" | "imu_orientation" | "pva_orientation") => {
            (TermSource::Quaternion(name.to_owned()), false)
        }
        "projected_gravity" => (TermSource::Gravity, false),
        "joint_pos" => (TermSource::Joints("joint_pos", "rad"), false),
        "joint_pos_rel" => (TermSource::Joints("joint_pos", "rad"), true),
        "joint_vel" => (TermSource::Joints("joint_vel", "rad/s"), false),
        "joint_vel_rel" => (TermSource::Joints("joint_vel", "rad/s"), true),
        "joint_effort" => (TermSource::Joints("joint_effort", "N m"), false),
        _ => return None,
    })
}

/// A part of the action.
#[derive(Debug)]
pub(super) struct Action {
    pub(super) name: String,
    pub(super) kind: Kind,
    /// Places of its joints, in the order of its values.
    pub(super) joints: Vec<usize>,
    /// One number for each value.
    pub(super) scale: Vec<f64>,
    pub(super) offset: Vec<f64>,
    pub(super) clip: Option<Vec<[f64; 2]>>,
    pub(super) from: String,
}

/// Quantity of an action's target.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Position,
    /// A position relative to that of this moment.
    Relative,
    Velocity,
    Effort,
}

impl Kind {
    /// Finds the kind by the class of Isaac Lab.
    ///
    /// # Errors
    ///
    /// If it is another class.
    pub(super) fn of(class: &str, at: &str) -> Result<Self> {
        let own = MODULES.iter().find_map(|module| class.strip_prefix(module)?.strip_prefix("actions.joint_actions."));
        Ok(match own {
            Some("JointPositionAction") => Self::Position,
            Some("RelativeJointPositionAction") => Self::Relative,
            Some("JointVelocityAction") => Self::Velocity,
            Some("JointEffortAction") => Self::Effort,
            _ => {
                return Err(actq::error::Error::input(format!(
                    "{at} = {:?}: this action is not known to this reader, which knows JointPositionAction, \
                     RelativeJointPositionAction, JointVelocityAction and JointEffortAction of \
                     isaaclab.envs.mdp.actions.joint_actions; write deploy.toml by docs/DEPLOY.md",
                    actq::text::printable(class)
                )));
            }
        })
    }
}

/// Refuses a name that a description cannot have.
pub(super) fn plain(name: &str, at: &str) -> Result<()> {
    let is_plain = !name.is_empty() && name.chars().all(|c| c.is_alphanumeric() || c == '_');
    ensure!(is_plain, "{at}: {:?} is not a name of letters, digits and _", actq::text::printable(name));
    Ok(())
}

/// Returns the places of each action's values in the whole action.
pub(super) fn parts_of(actions: &[Action]) -> Vec<Vec<usize>> {
    let mut start = 0;
    let part = |action: &Action| {
        let places = (start..start + action.joints.len()).collect();
        start += action.joints.len();
        places
    };
    actions.iter().map(part).collect()
}
