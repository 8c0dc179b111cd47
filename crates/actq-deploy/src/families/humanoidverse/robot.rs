//! A robot's joints.

use std::collections::BTreeSet;

use actq::error::{Context as _, Result, ensure};

use super::lengths::{count, whole};
use crate::document::Document;
use crate::facts::Facts;
use crate::yaml::Node;

/// Key of the default pose.
const DEFAULT: &str = "DEFAULT_DOF_ANGLES";
/// Key of the joints' names.
const NAMES: &str = "dof_names";

/// A robot's joints, in the order of DEFAULT_DOF_ANGLES.
pub(super) struct Robot {
    pub(super) default: Vec<f64>,
    pub(super) names: Vec<String>,
    /// `true` if raw values have the order of the names; otherwise, they are by position.
    pub(super) by_name: bool,
    /// Places of the joints of the upper body.
    pub(super) upper: Vec<usize>,
}

impl Robot {
    pub(super) fn read(yaml: &Document, facts: &mut Facts) -> Result<Self> {
        let default = yaml.numbers(DEFAULT)?;
        let n = default.len();
        ensure!(n > 0, "{} is empty", yaml.location(DEFAULT));
        facts.note("default", yaml.location(DEFAULT));
        if let Some(joints) = yaml.optional("NUM_JOINTS", "a number of joints", count)? {
            same_number(yaml, n, "NUM_JOINTS", joints, "joints")?;
        }
        ask_for_order(yaml, facts)?;
        let names = yaml.optional(NAMES, "a list of texts", Node::texts)?.unwrap_or_default();
        if !names.is_empty() {
            same_number(yaml, n, NAMES, names.len(), "names")?;
            ensure!(names.iter().collect::<BTreeSet<_>>().len() == n, "{}: a name occurs twice", yaml.location(NAMES));
        }
        let upper = upper_body(yaml, n, &names)?;
        let by_name = !names.is_empty() && facts.is_choice("joint_order", "names")?;
        let order = if names.is_empty() { yaml.location(DEFAULT) } else { facts.source("joint_order") };
        facts.note("joint order", order);
        Ok(Self { default, names, by_name, upper })
    }

    pub(super) fn len(&self) -> usize {
        self.default.len()
    }
}

/// Refuses a key with another number of joints than the default pose.
fn same_number(yaml: &Document, n: usize, key: &str, len: usize, what: &str) -> Result<()> {
    if len == n {
        return Ok(());
    }
    Err(Facts::contradiction(
        "number of joints",
        (&yaml.location(DEFAULT), &format!("{n} joints")),
        (&yaml.location(key), &format!("{len} {what}")),
    ))
}

/// Asks for the order of the application's values if the motors have another order than the joints, or move in
/// parallel.
fn ask_for_order(yaml: &Document, facts: &mut Facts) -> Result<()> {
    let mut reordered = false;
    for key in ["JOINT2MOTOR", "MOTOR2JOINT"] {
        let map = yaml.optional(key, "a list of numbers", Node::numbers)?;
        reordered |= map.is_some_and(|map| !map.iter().enumerate().all(|(i, place)| *place == i as f64));
    }
    let parallel = yaml.optional("MOTOR_TYPE", "a text", Node::text)? == Some("parallel");
    if reordered || parallel {
        let what = if parallel { "MOTOR_TYPE is parallel" } else { "JOINT2MOTOR is not the identity" };
        let meaning = format!(
            "{what}; does the application give and take joint values in the order of DEFAULT_DOF_ANGLES (true)?"
        );
        let given = facts.missing::<bool>("raw.joints", &meaning)?;
        ensure!(given != Some(false), "raw.joints = false: values of motors are not supported; convert them first");
    }
    Ok(())
}

/// Returns the places of the joints of the upper body: those that the file names, or else the last ones.
fn upper_body(yaml: &Document, n: usize, names: &[String]) -> Result<Vec<usize>> {
    let (counted, named) = ("NUM_UPPER_BODY_JOINTS", "dof_names_upper_body");
    let number = yaml.optional(counted, "a number of joints", whole)?;
    let upper: Vec<usize> = match yaml.optional(named, "a list of texts", Node::texts)? {
        Some(upper) => {
            let place = |name: &String| {
                let place = names.iter().position(|other| other == name);
                place.with_context(|| format!("{}: {name:?} is not one of dof_names", yaml.location(named)))
            };
            upper.iter().map(place).collect::<Result<_>>()?
        }
        None => {
            let number = number.unwrap_or(0);
            ensure!(number <= n, "{} = {number}, but there are {n} joints", yaml.location(counted));
            (n - number..n).collect()
        }
    };
    let distinct = upper.iter().collect::<BTreeSet<_>>().len();
    ensure!(distinct == upper.len(), "{}: a name occurs twice", yaml.location(named));
    match number {
        Some(number) if number != upper.len() => Err(Facts::contradiction(
            "number of joints of the upper body",
            (&yaml.location(counted), &number.to_string()),
            (&yaml.location(named), &format!("{} names", upper.len())),
        )),
        _ => Ok(upper),
    }
}
