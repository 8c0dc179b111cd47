//! Joint orders, defaults, scales and gains.

use actq::error::{Context as _, Result, ensure};
use actq::text::printable;

use super::super::common::{Graph, Parts, names, numbers};
use super::agreed::{ByJoint, agreed, order};
use super::ros::{ROS_KEY, Ros};
use super::stated::ROUNDING;
use crate::description::{Op, Operand, Order};
use crate::document::Document;
use crate::facts::Facts;
use crate::yaml::Node;

/// Ends the name of a document of metadata.
const METADATA: &str = " metadata: ";
/// Key of the joints' names in the metadata.
const NAMES: &str = "joint_names";

/// Joint orders, defaults, scales and gains.
pub(super) struct Robot {
    /// Names of all joints in the order of the raw inputs.
    pub(super) raw: Vec<String>,
    /// Those that the policy observes.
    pub(super) observed: Vec<String>,
    /// Those that it moves.
    pub(super) moved: Vec<String>,
    /// Those whose targets are sent.
    pub(super) sent: Vec<String>,
    /// Numbers of the observed joints.
    pub(super) default: Vec<f64>,
    pub(super) signs: Option<Vec<f64>>,
    /// Numbers of the moved joints.
    pub(super) scale: Vec<f64>,
    pub(super) gains: Option<[Vec<f64>; 2]>,
    pub(super) source: String,
    pub(super) default_source: String,
    pub(super) scale_source: String,
    pub(super) gains_source: String,
}

impl Robot {
    pub(super) fn of(meta: &Document, ros: Option<&Ros<'_>>, graph: &Graph, facts: &mut Facts) -> Result<Self> {
        let raw = names(meta, NAMES)?;
        let listed = match ros {
            Some(ros) => ros.yaml.texts(&ros.path(&format!("joints.{ROS_KEY}")))?,
            None => Vec::new(),
        };
        let (observed, source) = observed_joints(meta, ros, &raw, &listed, facts)?;
        let moved = moved_joints(&observed, &source, graph, facts)?;
        let given = JointNumbers { meta, ros, raw: &raw, moved: &moved, listed: &listed };
        let (default, default_source) =
            agreed(given.pair("default_joint_pos", "walkready_state", false)?, "default_pose", &observed, facts)?
                .with_context(|| format!("{} is missing", meta.location("default_joint_pos")))?;
        let (scale, scale_source) =
            agreed(given.pair("action_scale", "action_scales", true)?, "action_scale", &moved, facts)?
                .with_context(|| format!("{} is missing", meta.location("action_scale")))?;
        let stiffness = agreed(given.pair("joint_stiffness", "kp", false)?, "stiffness", &moved, facts)?;
        let damping = agreed(given.pair("joint_damping", "kd", false)?, "damping", &moved, facts)?;
        let (gains, gains_source) = match (stiffness, damping) {
            (Some((stiffness, first)), Some((damping, second))) => {
                (Some([stiffness, damping]), format!("{first}; {second}"))
            }
            _ => (None, String::new()),
        };
        let signs = given.signs(&observed)?;
        let sent = sent_joints(ros, &moved)?;
        Ok(Self {
            raw,
            observed,
            moved,
            sent,
            default,
            signs,
            scale,
            gains,
            source,
            default_source,
            scale_source,
            gains_source,
        })
    }

    /// Adds the lists of joints and numbers.
    pub(super) fn describe(&self, parts: &mut Parts) {
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
        let of_metadata = |source: &str| source.contains(METADATA) && !source.contains(';');
        for (name, list, source) in
            [("default", &self.default, &self.default_source), ("action_scale", &self.scale, &self.scale_source)]
        {
            let rounding = if of_metadata(source) { ROUNDING } else { 0.0 };
            parts.rounded_constant(name, list.clone(), rounding);
        }
        if let Some(signs) = &self.signs {
            parts.constant("signs", signs.clone());
        }
    }

    /// Returns the name of the order of the observed joints.
    fn observed_order(&self) -> &'static str {
        if self.observed == self.raw { "robot" } else { "policy" }
    }

    /// Returns the name of the order of the moved joints.
    pub(super) fn moved_order(&self) -> &'static str {
        if self.moved == self.observed { self.observed_order() } else { "moved" }
    }

    /// Returns the name of the order of the joints whose targets are sent.
    pub(super) fn sent_order(&self) -> &'static str {
        if self.sent == self.moved { self.moved_order() } else { "sent" }
    }

    /// Returns the places of the moved joints among the observed ones, or nothing if they are the same.
    pub(super) fn moved_places(&self) -> Option<Vec<usize>> {
        let place = |joint: &String| self.observed.iter().position(|other| other == joint);
        (self.moved != self.observed).then(|| self.moved.iter().filter_map(place).collect())
    }

    /// Takes a list of the observed joints' numbers for the moved ones.
    pub(super) fn of_moved(&self, list: &[f64]) -> Vec<f64> {
        match self.moved_places() {
            Some(places) => places.iter().filter_map(|place| list.get(*place).copied()).collect(),
            None => list.to_vec(),
        }
    }

    /// Returns the operations that order a raw input of all joints.
    pub(super) fn select(&self) -> Vec<Op> {
        let select = || Op::Select(Order::Joints("policy".to_owned()));
        let mut ops: Vec<Op> = (self.observed != self.raw).then(select).into_iter().collect();
        ops.extend(self.signs.is_some().then(|| Op::Scale(Operand::Name("signs".to_owned()))));
        ops
    }
}

/// Returns the joints that the policy observes, in its order, and where they are. `listed` are those of the YAML file.
fn observed_joints(
    meta: &Document,
    ros: Option<&Ros<'_>>,
    raw: &[String],
    listed: &[String],
    facts: &mut Facts,
) -> Result<(Vec<String>, String)> {
    let at = meta.location(NAMES);
    let Some(ros) = ros else { return Ok((raw.to_vec(), at)) };
    order(raw, &at, listed, &ros.yaml.location(&ros.path(&format!("joints.{ROS_KEY}"))), facts)
}

/// Returns the joints that the policy moves: all that it observes, or as many as the graph has actions.
fn moved_joints(observed: &[String], source: &str, graph: &Graph, facts: &mut Facts) -> Result<Vec<String>> {
    if observed.len() == graph.actions {
        return Ok(observed.to_vec());
    }
    if graph.actions > observed.len() {
        return Err(Facts::contradiction(
            "number of joints",
            (source, &format!("{} joints", observed.len())),
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
    Ok(moved)
}

/// Returns the joints whose targets are sent: those that the policy moves and the ROS 2 node controls.
fn sent_joints(ros: Option<&Ros<'_>>, moved: &[String]) -> Result<Vec<String>> {
    let mut uncontrolled = Vec::new();
    if let Some(ros) = ros {
        let path = ros.path("joints.uncontrolled_joint_names");
        uncontrolled = ros.yaml.optional(&path, "a list of names", Node::texts)?.unwrap_or_default();
    }
    let sent: Vec<String> = moved.iter().filter(|joint| !uncontrolled.contains(joint)).cloned().collect();
    ensure!(!sent.is_empty(), "uncontrolled_joint_names names all joints that the policy moves");
    Ok(sent)
}

/// The files that give numbers of joints, and the joints that their lists are of.
struct JointNumbers<'a> {
    meta: &'a Document,
    ros: Option<&'a Ros<'a>>,
    raw: &'a [String],
    moved: &'a [String],
    /// Joints of the YAML file.
    listed: &'a [String],
}

impl JointNumbers<'_> {
    /// Returns numbers by joint of the metadata, and of the YAML file. With `one`, a single number is that of all
    /// joints.
    fn pair(&self, own: &str, yaml: &str, one: bool) -> Result<(Option<ByJoint>, Option<ByJoint>)> {
        Ok((self.of_metadata(own, one)?, self.of_ros(yaml)?))
    }

    fn of_metadata(&self, key: &str, one: bool) -> Result<Option<ByJoint>> {
        let Some(list) = numbers(self.meta, key)? else { return Ok(None) };
        let (raw, moved) = (self.raw, self.moved);
        let all = match list.len() {
            1 if one => raw.iter().map(|joint| (joint.clone(), list[0])).collect(),
            len if len == raw.len() => raw.iter().cloned().zip(list).collect(),
            len if len == moved.len() => moved.iter().cloned().zip(list).collect(),
            len => {
                return Err(Facts::contradiction(
                    "number of joints",
                    (&self.meta.location(key), &format!("{len} values")),
                    (&self.meta.location(NAMES), &format!("{} joints, of which {} move", raw.len(), moved.len())),
                ));
            }
        };
        Ok(Some((all, self.meta.location(key))))
    }

    fn of_ros(&self, key: &str) -> Result<Option<ByJoint>> {
        let Some(ros) = self.ros else { return Ok(None) };
        let list = ros.numbers(key, self.listed.len())?;
        let at = ros.yaml.location(&ros.path(&format!("joints.{key}")));
        Ok(list.map(|list| (self.listed.iter().cloned().zip(list).collect(), at)))
    }

    /// Returns the signs of the observed joints, if the YAML file has signs.
    fn signs(&self, observed: &[String]) -> Result<Option<Vec<f64>>> {
        let Some((signs, at)) = self.of_ros("joint_signs")? else { return Ok(None) };
        let signs: Vec<f64> = observed.iter().filter_map(|joint| signs.get(joint).copied()).collect();
        ensure!(signs.iter().all(|sign| sign.abs() == 1.0), "{at}: give 1 or -1 for each joint");
        Ok(Some(signs))
    }
}
