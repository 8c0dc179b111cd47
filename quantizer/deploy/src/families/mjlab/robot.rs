//! Joints with their numbers.

use actq::error::{Context as _, Result, ensure};
use actq::text::printable;

use super::super::common::{Graph, Parts, names, numbers};
use super::agreed::{ByJoint, agreed, order};
use super::ros::{ROS_KEY, Ros};
use crate::description::{Op, Operand, Order};
use crate::document::Document;
use crate::facts::Facts;
use crate::yaml::Node;

/// Joints with their numbers, in the policy's order.
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
