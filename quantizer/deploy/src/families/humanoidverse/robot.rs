//! A robot's joints.

use std::collections::BTreeSet;

use actq::error::{Context as _, Result, ensure};

use super::lengths::{count, whole};
use crate::document::Document;
use crate::facts::Facts;
use crate::yaml::Node;

/// A robot's joints, in the order of DEFAULT_DOF_ANGLES.
pub(super) struct Robot {
    pub(super) default: Vec<f64>,
    pub(super) names: Vec<String>,
    /// Whether the names are those of the joints; the raw values are by position otherwise.
    pub(super) by_name: bool,
    /// Places of the joints of the upper body.
    pub(super) upper: Vec<usize>,
}

impl Robot {
    pub(super) fn read(yaml: &Document, facts: &mut Facts) -> Result<Self> {
        let default = yaml.numbers("DEFAULT_DOF_ANGLES")?;
        let n = default.len();
        ensure!(n > 0, "{} is empty", yaml.at("DEFAULT_DOF_ANGLES"));
        facts.note("default", yaml.at("DEFAULT_DOF_ANGLES"));
        let same = |key: &str, len: usize, what: &str| {
            let (at, of) = (yaml.at("DEFAULT_DOF_ANGLES"), yaml.at(key));
            if len == n {
                return Ok(());
            }
            Err(Facts::contradiction(
                "number of joints",
                (&at, &format!("{n} joints")),
                (&of, &format!("{len} {what}")),
            ))
        };
        if let Some(joints) = yaml.maybe("NUM_JOINTS", "a number of joints", count)? {
            same("NUM_JOINTS", joints, "joints")?;
        }
        let mut reordered = false;
        for key in ["JOINT2MOTOR", "MOTOR2JOINT"] {
            let map = yaml.maybe(key, "a list of numbers", Node::numbers)?;
            reordered |= map.is_some_and(|map| !map.iter().enumerate().all(|(i, place)| *place == i as f64));
        }
        let parallel = yaml.maybe("MOTOR_TYPE", "a text", Node::text)? == Some("parallel");
        if reordered || parallel {
            let what = if parallel { "MOTOR_TYPE is parallel" } else { "JOINT2MOTOR is not the identity" };
            let meaning = format!(
                "{what}; does the application give and take joint values in the order of DEFAULT_DOF_ANGLES (true)?"
            );
            let given = facts.missing::<bool>("raw.joints", &meaning)?;
            ensure!(given != Some(false), "raw.joints = false: values of motors are not supported; convert them first");
        }

        let names = yaml.maybe("dof_names", "a list of texts", Node::texts)?.unwrap_or_default();
        if !names.is_empty() {
            same("dof_names", names.len(), "names")?;
            ensure!(names.iter().collect::<BTreeSet<_>>().len() == n, "{}: a name occurs twice", yaml.at("dof_names"));
        }
        let number = yaml.maybe("NUM_UPPER_BODY_JOINTS", "a number of joints", whole)?;
        let upper: Vec<usize> = match yaml.maybe("dof_names_upper_body", "a list of texts", Node::texts)? {
            Some(upper) => {
                let place = |name: &String| {
                    let place = names.iter().position(|other| other == name);
                    place.with_context(|| {
                        format!("{}: {name:?} is not one of dof_names", yaml.at("dof_names_upper_body"))
                    })
                };
                upper.iter().map(place).collect::<Result<_>>()?
            }
            None => {
                let number = number.unwrap_or(0);
                ensure!(number <= n, "{} = {number}, but there are {n} joints", yaml.at("NUM_UPPER_BODY_JOINTS"));
                (n - number..n).collect()
            }
        };
        ensure!(
            upper.iter().collect::<BTreeSet<_>>().len() == upper.len(),
            "{}: a name occurs twice",
            yaml.at("dof_names_upper_body")
        );
        if let Some(number) = number.filter(|number| *number != upper.len()) {
            return Err(Facts::contradiction(
                "number of joints of the upper body",
                (&yaml.at("NUM_UPPER_BODY_JOINTS"), &number.to_string()),
                (&yaml.at("dof_names_upper_body"), &format!("{} names", upper.len())),
            ));
        }
        let by_name = !names.is_empty() && facts.chooses("joint_order", "names")?;
        let order = if names.is_empty() { yaml.at("DEFAULT_DOF_ANGLES") } else { facts.source("joint_order") };
        facts.note("joint order", order);
        Ok(Self { default, names, by_name, upper })
    }

    pub(super) fn len(&self) -> usize {
        self.default.len()
    }
}
