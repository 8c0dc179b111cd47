//! The parameters of a ROS 2 node.

use actq::error::{Result, ensure};

use crate::document::Document;
use crate::yaml::Node;

/// Key that only the ROS 2 node's YAML file has.
pub(super) const ROS_KEY: &str = "ordered_relevant_joint_names";

/// A node of a ROS 2 parameters file.
#[derive(Clone)]
pub(super) struct RosNode {
    pub(super) name: String,
    /// Name of its ONNX file.
    pub(super) model: String,
}

impl RosNode {
    /// Returns the nodes of a file that have joints of a policy.
    pub(super) fn all(yaml: &Document) -> Result<Vec<Self>> {
        let mut nodes = Vec::new();
        for name in yaml.keys("") {
            let at = format!("{name}.ros__parameters");
            if yaml.peek(&format!("{at}.joints.{ROS_KEY}")).is_some() {
                let model = yaml.required(&format!("{at}.model"), "the name of an ONNX file", Node::text)?;
                nodes.push(Self { name: name.to_owned(), model: model.to_owned() });
            }
        }
        Ok(nodes)
    }
}

/// The ROS 2 node's part of a bundle.
pub(super) struct Ros<'a> {
    pub(super) yaml: &'a Document,
    /// Path of its parameters.
    pub(super) at: String,
}

impl Ros<'_> {
    pub(super) fn path(&self, key: &str) -> String {
        format!("{}.{key}", self.at)
    }

    /// Returns a list of the joints' numbers, if it is there.
    pub(super) fn numbers(&self, key: &str, joints: usize) -> Result<Option<Vec<f64>>> {
        let path = self.path(&format!("joints.{key}"));
        let numbers = self.yaml.optional(&path, "a list of finite numbers", Node::numbers)?;
        if let Some(numbers) = &numbers {
            ensure!(
                numbers.len() == joints,
                "{} has {} values, but {ROS_KEY} {joints} names",
                self.yaml.location(&path),
                numbers.len()
            );
        }
        Ok(numbers)
    }
}
