//! The order of the policy's joints among the robot's.

use actq::error::{Result, bail, ensure};

use super::super::common::{Parts, counts};
use super::config::{Config, Section};
use crate::description::{Gains, Op, Order, TargetKind};
use crate::facts::Facts;

/// The robot's joints, and which of them the policy moves.
#[derive(Debug)]
pub(super) struct Joints {
    /// The robot's joint of each joint of the policy.
    map: Vec<usize>,
    /// Number of the robot's joints.
    robot: usize,
    /// The lists `robot` and `policy_order` have their names.
    named: bool,
}

/// Name of the list of the policy's joints.
const ORDER: &str = "policy_order";

impl Joints {
    /// Reads names and mapping, and adds the lists of names.
    pub(super) fn read(config: &Config<'_>, parts: &mut Parts, facts: &mut Facts) -> Result<Self> {
        let n = config.joints()?;
        let mapping = mapping(config)?;
        // Of the older layout, ROS 1 read names in the order of the policy, and ROS 2 in that of the robot.
        let has_names = mapping.as_ref().is_none_or(|(key, map)| *key == "joint_mapping" || is_identity(map));
        let names = if has_names { names(config)? } else { None };
        let (key, map) = match (mapping, &names) {
            (Some(mapping), _) => mapping,
            (None, Some(names)) => (names.key, (0..names.list.len()).collect()),
            (None, None) => {
                bail!("{} is missing, and there are no joint_names; add one of them", config.location("joint_mapping"))
            }
        };
        config.check(key, map.len())?;
        let robot = names.as_ref().map_or(n, |names| names.list.len());
        let mut taken = vec![false; robot];
        for (i, joint) in map.iter().enumerate() {
            let Some(taken) = taken.get_mut(*joint) else {
                let source =
                    names.as_ref().map_or_else(|| config.location("num_of_dofs"), |names| names.source.clone());
                return Err(Facts::contradiction(
                    "number of the robot's joints",
                    (&config.location(key), &format!("joint {i} of the policy is joint {joint} of the robot")),
                    (&source, &format!("{robot} joints")),
                ));
            };
            ensure!(!*taken, "{}: joint {joint} occurs twice", config.location(key));
            *taken = true;
        }
        let named = names.is_some();
        if let Some(Names { source, list, .. }) = names {
            facts.note("robot", source);
            if !(map.len() == robot && is_identity(&map)) {
                facts.note(ORDER, config.location(key));
                parts.joints(ORDER, map.iter().map(|joint| list[*joint].clone()).collect());
            }
            parts.joints("robot", list);
        }
        facts.note("joint order", config.location(key));
        Ok(Self { map, robot, named })
    }

    /// Returns the number of the policy's joints.
    pub(super) fn len(&self) -> usize {
        self.map.len()
    }

    /// Adds a raw input of the robot's joints, and begins the term of its name; returns the operations that select the
    /// policy's joints.
    pub(super) fn input(&self, parts: &mut Parts, name: &str, unit: &str) -> Vec<Op> {
        let select = if self.named {
            parts.raw_joints(name, "robot", unit);
            parts.begin(name, name);
            Order::Joints(ORDER.to_owned())
        } else {
            parts.input(name, self.robot, unit);
            Order::Places(self.map.clone())
        };
        if self.is_same() { Vec::new() } else { vec![Op::Select(select)] }
    }

    /// The policy's order is that of the robot.
    fn is_same(&self) -> bool {
        self.moves_all() && is_identity(&self.map)
    }

    /// The policy moves all joints of the robot.
    fn moves_all(&self) -> bool {
        self.map.len() == self.robot
    }

    /// Returns the list of names that targets and gains are in the order of.
    fn order(&self) -> Option<&'static str> {
        self.named.then_some(if self.moves_all() { "robot" } else { ORDER })
    }

    /// Adds a target of the policy's joints: in the order of the robot, if the policy moves all its joints.
    pub(super) fn target(&self, parts: &mut Parts, kind: TargetKind, name: &str, from: &str, mut ops: Vec<Op>) {
        if self.moves_all() && !self.is_same() {
            ops.push(Op::Place(Order::Places(self.map.clone())));
        }
        parts.value(name, from, ops);
        match self.order() {
            Some(order) => parts.target_joints(kind, name, order),
            None => parts.target(kind, name),
        }
    }

    /// Adds the gains, in the order of the targets.
    pub(super) fn gains(&self, parts: &mut Parts, stiffness: &[f64], damping: &[f64]) {
        let ordered = |gains: &[f64]| {
            let mut ordered = gains.to_vec();
            if self.moves_all() {
                self.map.iter().zip(gains).for_each(|(joint, gain)| ordered[*joint] = *gain);
            }
            ordered
        };
        let joints = self.order().map(str::to_owned);
        parts.gains(Gains { joints, stiffness: ordered(stiffness), damping: ordered(damping) });
    }
}

fn is_identity(map: &[usize]) -> bool {
    map.iter().enumerate().all(|(i, joint)| i == *joint)
}

/// Returns the robot's joint of each joint of the policy, and the key that has it.
fn mapping(config: &Config<'_>) -> Result<Option<(&'static str, Vec<usize>)>> {
    let list = |key: &str| config.optional(key, "a list of joints' numbers, from 0", counts);
    if let Some(map) = list("joint_mapping")? {
        return Ok(Some(("joint_mapping", map)));
    }
    let (Some(state), command) = (list("state_mapping")?, list("command_mapping")?) else { return Ok(None) };
    // The older layout has the reverse permutation, too.
    let command = command.unwrap_or_default();
    let reverse = state.len() == command.len() && (0..state.len()).all(|i| command.get(state[i]) == Some(&i));
    if !reverse {
        return Err(Facts::contradiction(
            "order of the joints",
            (&config.location("state_mapping"), &format!("{state:?}")),
            (&config.location("command_mapping"), &format!("{command:?}, which is not its reverse")),
        ));
    }
    Ok(Some(("state_mapping", state)))
}

/// Names of the robot's joints.
struct Names {
    key: &'static str,
    source: String,
    list: Vec<String>,
}

/// Returns the names of the robot's joints, if there are some.
fn names(config: &Config<'_>) -> Result<Option<Names>> {
    for key in ["joint_names", "joint_controller_names"] {
        let of = |section: Section<'_>| -> Result<Option<Names>> {
            let list = section.names(key)?;
            Ok(list.map(|list| Names { key, source: section.location(key), list }))
        };
        let (own, base) = (of(config.own)?, config.base.map(of).transpose()?.flatten());
        if let (Some(own), Some(base)) = (&own, &base) {
            // The policy's list may end before the robot's.
            if let Some(i) = own.list.iter().zip(&base.list).position(|(own, base)| own != base) {
                let joint = |names: &Names| format!("joint {i} (from 0) is {:?}", names.list[i]);
                return Err(Facts::contradiction(
                    "order of the joints",
                    (&own.source, &joint(own)),
                    (&base.source, &joint(base)),
                ));
            }
        }
        // Numbers of the mapping are those of the robot's list.
        let longer = [own, base].into_iter().flatten().max_by_key(|names| names.list.len());
        if longer.is_some() {
            return Ok(longer);
        }
    }
    Ok(None)
}
