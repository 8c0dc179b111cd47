//! The joints' names, their default pose and their gains.

use actq::error::{Context as _, Error, Result, bail, ensure};
use actq::text::printable;
use serde::Deserialize;

use super::robot::Robot;
use crate::description::Gains;
use crate::document::Document;
use crate::facts::Facts;
use crate::yaml::Node;

/// Returns the joints' names: those of the MuJoCo file, or of the metadata.
pub(super) fn joint_names(meta: &Document, robot: Option<&Robot>, n: usize, facts: &mut Facts) -> Result<Vec<String>> {
    let path = "joint_names";
    let stated = meta.optional(path, "a list of names", Node::texts)?;
    if let Some(stated) = &stated {
        ensure!(
            stated.len() == n,
            "{} has {} names; {n} are needed, one for each action",
            meta.location(path),
            stated.len()
        );
    }
    let (names, source) = match (robot, stated) {
        (Some(robot), None) => (robot.joints.clone(), robot.file.clone()),
        (None, Some(stated)) => (stated, meta.location(path)),
        (Some(robot), Some(stated)) => {
            if let Some(i) = (0..n).find(|&i| stated.get(i) != robot.joints.get(i)) {
                let shown = |names: &[String]| {
                    let name = names.get(i).map_or("nothing", String::as_str);
                    format!("joint {i} is {:?}: {}", printable(name), names.join(", "))
                };
                return Err(Facts::contradiction(
                    "order of the joints",
                    (&meta.location(path), &shown(&stated)),
                    (&robot.file, &shown(&robot.joints)),
                ));
            }
            (stated, format!("{}; {}", meta.location(path), robot.file))
        }
        (None, None) => {
            let names: Option<Vec<String>> = facts.missing(
                "joints.names",
                "the bundle has no MuJoCo file (.xml) of the robot; which joints does the policy have, in order?",
            )?;
            let names = names.unwrap_or_else(|| (0..n).map(|i| format!("joint_{i}")).collect());
            ensure!(names.len() == n, "joints.names has {} names; {n} are needed, one for each action", names.len());
            (names, facts.source("joints.names"))
        }
    };
    facts.note("joint order", source);
    Ok(names)
}

/// The rule default_pose.
#[derive(Deserialize)]
#[serde(untagged)]
enum Pose {
    Of(String),
    Numbers(Vec<f64>),
}

pub(super) fn default_pose(meta: &Document, robot: Option<&Robot>, n: usize, facts: &mut Facts) -> Result<Vec<f64>> {
    let key = "default_pose";
    let standing = meta.optional("default_standing", "numbers", Node::numbers)?;
    let rule: Option<Pose> = facts.value(key)?;
    let (pose, source) = match rule {
        Some(Pose::Numbers(numbers)) => (numbers, facts.source(key)),
        Some(Pose::Of(of)) if of == "default_standing" => {
            let standing =
                standing.clone().with_context(|| format!("{} is missing", meta.location("default_standing")))?;
            (standing, format!("{}; {}", meta.location("default_standing"), facts.source(key)))
        }
        Some(Pose::Of(of)) if of == "keyframe" => {
            let name: Option<String> = facts.value("keyframe")?;
            let keyframe = match (&name, robot) {
                (Some(name), Some(robot)) => robot.keyframe(name)?,
                _ => None,
            };
            match (keyframe, robot, &name) {
                (Some(pose), Some(robot), Some(name)) => {
                    (pose, format!("{}: keyframe {name:?}; {}", robot.file, facts.source(key)))
                }
                (_, _, None) => (vec![0.0; n], facts.source("keyframe")),
                _ => {
                    // Upstream takes zeros then, and prints so; a person must decide here.
                    let file = robot.map_or("the bundle", |robot| &robot.file);
                    let wanted = name.unwrap_or_default();
                    let meaning = format!(
                        "{file} has no keyframe {wanted:?}, for which upstream's code takes zeros; give the default pose as a list of {n} numbers, or \"default_standing\"",
                    );
                    let pose: Option<Vec<f64>> = facts.missing(key, &meaning)?;
                    (pose.unwrap_or_else(|| vec![0.0; n]), facts.source(key))
                }
            }
        }
        Some(Pose::Of(of)) => bail!("{key} = {of:?}: give \"keyframe\", \"default_standing\" or a list of numbers"),
        None => (vec![0.0; n], facts.source(key)),
    };
    ensure!(
        pose.len() == n,
        "the default pose ({source}) has {} values; {n} are needed, one for each action",
        pose.len()
    );
    let differs = standing.is_some_and(|standing| standing != pose);
    let other = if differs {
        format!(" ({} differs, and is not used)", meta.location("default_standing"))
    } else {
        String::new()
    };
    facts.note("default", format!("{source}{other}"));
    Ok(pose)
}

/// Returns the gains: one for each joint, by the joints' names, or by the rule gains.places.
pub(super) fn gains(meta: &Document, joints: &[String], facts: &mut Facts) -> Result<Option<Gains>> {
    let mut lists = Vec::new();
    for path in ["robot_stiffness", "robot_damping"] {
        let Some(node) = meta.node(path) else { return Ok(None) };
        // Which joint a gain belongs to is not known before the joints' names are.
        if facts.is_open("joints.names") {
            continue;
        }
        let wrong = || format!("{} must be finite numbers", meta.location(path));
        let kinds: Option<Vec<f64>> = node.entries().iter().map(|(_, kind)| kind.number()).collect();
        let numbers = node.numbers().or(kinds.filter(|kinds| !kinds.is_empty())).with_context(wrong)?;
        let by_name: Option<Vec<f64>> = joints.iter().map(|joint| node.get(joint)?.number()).collect();
        let list = match by_name {
            Some(list) => list,
            None if numbers.len() == joints.len() && node.entries().is_empty() => numbers,
            None => {
                let key = "gains.places";
                let fits = |places: &Vec<usize>| {
                    places.len() == joints.len() && places.iter().all(|place| *place < numbers.len())
                };
                let places: Option<Vec<usize>> = facts.value(key)?;
                let places = match places {
                    Some(places) if !fits(&places) => {
                        let meaning = format!(
                            "{} has {} values for {} joints, for which the family's places do not fit; which of them does each joint take (places from 0)?",
                            meta.location(path),
                            numbers.len(),
                            joints.len()
                        );
                        facts.missing::<Vec<usize>>(key, &meaning)?
                    }
                    other => other,
                };
                if places.as_ref().is_some_and(|places| !fits(places)) {
                    bail!("{key}: give {} places below {}", joints.len(), numbers.len());
                }
                let places = places.unwrap_or_default();
                let taken = places.iter().filter_map(|place| numbers.get(*place).copied()).collect::<Vec<_>>();
                if taken.is_empty() { vec![0.0; joints.len()] } else { taken }
            }
        };
        lists.push(list);
    }
    if lists.is_empty() {
        return Ok(None);
    }
    facts.note("gains", format!("{}; {}", meta.location("robot_stiffness"), meta.location("robot_damping")));
    let [stiffness, damping] = <[Vec<f64>; 2]>::try_from(lists).map_err(|_| Error::input("gains are incomplete"))?;
    Ok(Some(Gains { joints: Some("robot".to_owned()), stiffness, damping }))
}
