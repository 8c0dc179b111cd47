//! `IO_descriptors.yaml`: what Isaac Lab exports of an environment's observations and actions.

use actq::error::{Result, ensure};
use actq::text::printable;

use super::model::{Action, Kind, Layout, Policy, Sourced, Term, TermSource, known, observation, plain};
use super::patterns::{Joints, MAX_COUNT};
use super::values::{bounds, history, no_delay, numbers};
use crate::document::Document;
use crate::facts::Facts;
use crate::families::common::count;
use crate::yaml::Node;

/// Returns `true` if a file has the keys of exported descriptors.
pub(super) fn is_one(yaml: &Document) -> bool {
    ["actions", "observations", "articulations", "scene.dt"].iter().all(|key| yaml.peek(key).is_some())
}

/// Returns the order of the robot's joints.
pub(super) fn joints(yaml: &Document, asset: &str) -> Result<Joints> {
    let path = format!("articulations.{asset}");
    ensure!(
        yaml.peek(&path).is_some(),
        "{} is missing; answer asset with one of {}",
        yaml.location(&path),
        yaml.keys("articulations").iter().take(MAX_COUNT).map(|name| printable(name)).collect::<Vec<_>>().join(", ")
    );
    for other in yaml.keys("articulations").into_iter().filter(|other| *other != asset) {
        yaml.node(&format!("articulations.{other}"));
    }
    let path = format!("{path}.joint_names");
    Joints::new(yaml.texts(&path)?, yaml.location(&path))
}

pub(super) fn read(yaml: &Document, asset: &str, group: &str, joints: Joints) -> Result<Policy> {
    let rate = rate(yaml)?;
    let of_joints = |key: &str| {
        let path = format!("articulations.{asset}.{key}");
        let numbers = yaml.numbers(&path)?;
        ensure!(
            numbers.len() == joints.len(),
            "{} has {} values, but joint_names {}",
            yaml.location(&path),
            numbers.len(),
            joints.len()
        );
        Ok(Sourced { numbers, from: yaml.location(&path) })
    };
    let (default, default_velocity) = (of_joints("default_joint_pos")?, of_joints("default_joint_vel")?);
    let limits = limits(yaml, &format!("articulations.{asset}.default_joint_pos_limits"), joints.len())?;
    let gains = [of_joints("default_joint_stiffness")?, of_joints("default_joint_damping")?];
    // Actuators that are networks, and in later versions all that are computed outside of PhysX, have gains of 0 here.
    let gains = gains.iter().any(|gain| gain.numbers.iter().any(|number| *number != 0.0)).then_some(gains);
    let actions = actions(yaml, &joints)?;
    let terms = terms(yaml, group, &joints, &actions)?;
    // From release 3.0.0 on a group has an order, which the exporter leaves out.
    let group = format!("observations.{group}");
    // Each term's delay is read.
    let mut has_order = false;
    for item in yaml.keys(&group) {
        has_order |= no_delay(yaml, &format!("{group}.{item}.overloads"));
    }
    let layout = has_order.then(|| Layout::Left(yaml.location(&group)));
    let decimation = yaml.number("scene.decimation")?;
    Ok(Policy { rate, decimation, joints, default, default_velocity, limits, gains, terms, layout, actions })
}

/// Reads the lowest and highest positions of all joints.
fn limits(yaml: &Document, path: &str, joints: usize) -> Result<Option<[Sourced; 2]>> {
    let pairs = |node: &Node| node.items().iter().map(bounds).collect::<Option<Vec<_>>>();
    let Some(pairs) = yaml.optional(path, "pairs of numbers", pairs)? else { return Ok(None) };
    ensure!(pairs.len() == joints, "{} has {} pairs, but joint_names {joints}", yaml.location(path), pairs.len());
    let of = |i: usize| Sourced { numbers: pairs.iter().map(|pair| pair[i]).collect(), from: yaml.location(path) };
    Ok(Some([of(0), of(1)]))
}

fn rate(yaml: &Document) -> Result<Sourced> {
    let (dt, step, decimation) =
        (yaml.number("scene.dt")?, yaml.number("scene.physics_dt")?, yaml.number("scene.decimation")?);
    ensure!((1e-6..1e6).contains(&dt), "{} = {dt}: give the seconds of a tick", yaml.location("scene.dt"));
    if (step * decimation - dt).abs() > 1e-6 * dt {
        return Err(Facts::contradiction(
            "time of a tick",
            (&yaml.location("scene.dt"), &format!("{dt} s")),
            (&yaml.location("scene.physics_dt"), &format!("{step} s, {decimation} times")),
        ));
    }
    Ok(Sourced { numbers: vec![1.0 / dt], from: yaml.location("scene.dt") })
}

/// Reads one number for all values or one for each; `otherwise` if it is not there.
fn each(yaml: &Document, path: &str, len: usize, otherwise: f64) -> Result<Vec<f64>> {
    let given = yaml.optional(path, "finite numbers", numbers)?.unwrap_or_else(|| vec![otherwise]);
    ensure!(
        [1, len].contains(&given.len()),
        "{} has {} values; {len} joints are named",
        yaml.location(path),
        given.len()
    );
    Ok(if given.len() == len { given } else { vec![given[0]; len] })
}

fn actions(yaml: &Document, joints: &Joints) -> Result<Vec<Action>> {
    let mut actions = Vec::new();
    for item in yaml.keys("actions") {
        let of = |key: &str| format!("actions.{item}.{key}");
        let name = yaml.required(&of("name"), "a name", Node::text)?;
        plain(name, &yaml.location(&of("name")))?;
        let kind = Kind::of(yaml.required(&of("full_path"), "a class", Node::text)?, &yaml.location(&of("full_path")))?;
        let names = yaml.texts(&of("joint_names"))?;
        let places = joints.places(&names, &yaml.location(&of("joint_names")))?;
        ensure!(!places.is_empty(), "{} is empty", yaml.location(&of("joint_names")));
        if let Some(len) = yaml.optional(&of("shape"), "the number of values, as a list", one)? {
            ensure!(
                len == places.len(),
                "{} = [{len}], but joint_names has {} names",
                yaml.location(&of("shape")),
                places.len()
            );
        }
        let scale = each(yaml, &of("scale"), places.len(), 1.0)?;
        let offset = each(yaml, &of("offset"), places.len(), 0.0)?;
        let pairs = |node: &Node| node.items().iter().map(bounds).collect::<Option<Vec<_>>>();
        let clip = yaml.optional(&of("clip"), "pairs of numbers", pairs)?;
        if let Some(clip) = &clip {
            ensure!(
                clip.len() == places.len(),
                "{} has {} pairs; {} joints are named",
                yaml.location(&of("clip")),
                clip.len(),
                places.len()
            );
        }
        let from = yaml.location(&format!("actions.{item}"));
        actions.push(Action { name: name.to_owned(), kind, joints: places, scale, offset, clip, from });
    }
    ensure!(!actions.is_empty(), "{} has no actions", yaml.location("actions"));
    Ok(actions)
}

fn terms(yaml: &Document, group: &str, joints: &Joints, actions: &[Action]) -> Result<Vec<Term>> {
    let group = format!("observations.{group}");
    ensure!(
        yaml.peek(&group).is_some(),
        "{} is missing; answer group with one of {}",
        yaml.location(&group),
        yaml.keys("observations").iter().take(MAX_COUNT).map(|name| printable(name)).collect::<Vec<_>>().join(", ")
    );
    for other in yaml.keys("observations").into_iter().map(|other| format!("observations.{other}")) {
        if other != group {
            yaml.node(&other);
        }
    }
    let total = actions.iter().map(|action| action.joints.len()).sum();
    let mut terms: Vec<Term> = Vec::new();
    for item in yaml.keys(&group) {
        let term = term(yaml, &format!("{group}.{item}"), joints, total, &terms)?;
        terms.push(term);
    }
    Ok(terms)
}

/// Reads a term. `total` is the length of the action, and `before` are the terms before this one.
fn term(yaml: &Document, path: &str, joints: &Joints, total: usize, before: &[Term]) -> Result<Term> {
    let of = |key: &str| format!("{path}.{key}");
    let name = yaml.required(&of("name"), "a name", Node::text)?;
    plain(name, &yaml.location(&of("name")))?;
    let function = yaml.required(&of("full_path"), "a function", Node::text)?.to_owned();
    let len = yaml.required(&of("shape"), "the number of values, as a list", one)?;
    let (what, relative) = match content(name, &function, len, total) {
        _ if has_modifiers(yaml, path) => {
            let why = format!("term {name:?} has modifiers, which this reader does not know");
            (TermSource::Unknown(why, Some(len)), false)
        }
        Ok(known) => known,
        Err(why) => (TermSource::Unknown(why, Some(len)), false),
    };
    let (places, offset) = match what {
        TermSource::Joints(input, _) => observed_joints(yaml, path, joints, relative.then_some(input))?,
        _ => (Vec::new(), Vec::new()),
    };
    // Names are those of functions, which several terms may share.
    let same = before.iter().filter(|term| term.function == function).count();
    let name = if same == 0 { name.to_owned() } else { format!("{name}_{}", same + 1) };
    let term = Term {
        what: match what {
            TermSource::Command(_, len, ranges) => TermSource::Command(name.clone(), len, ranges),
            other => other,
        },
        name,
        function,
        joints: places,
        offset,
        clip: yaml.optional(&of("overloads.clip"), "two numbers", bounds)?,
        scale: yaml.optional(&of("overloads.scale"), "finite numbers", numbers)?,
        frames: history(yaml, &of("overloads"))?,
        from: yaml.location(path),
    };
    let own = term.len(total).unwrap_or(len);
    ensure!(own == len, "{} = [{len}], but the term has {own} values", yaml.location(&of("shape")));
    Ok(term)
}

/// Returns a term's content by its function, and `true` if a default is subtracted from it.
///
/// # Errors
///
/// The reason why only the application can compute it.
fn content(name: &str, function: &str, len: usize, total: usize) -> Result<(TermSource, bool), String> {
    match observation(function) {
        Some("generated_commands") => Ok((TermSource::Command(name.to_owned(), len, None), false)),
        Some("last_action") if len == total => Ok((TermSource::LastAction(None), false)),
        Some("last_action") => Err(format!("term {name:?} is a part of the last action, and only env.yaml says which")),
        _ => known(function).ok_or_else(|| {
            format!("the function of term {name:?}, {}, is not known to this reader", printable(function))
        }),
    }
}

fn has_modifiers(yaml: &Document, path: &str) -> bool {
    let modifiers = yaml.node(&format!("{path}.extras.modifiers"));
    modifiers.is_some_and(|node| !node.items().is_empty() || !node.entries().is_empty())
}

/// Returns the places of a term's joints, and the offsets that are subtracted from the values of its raw input.
fn observed_joints(
    yaml: &Document,
    path: &str,
    joints: &Joints,
    relative: Option<&str>,
) -> Result<(Vec<usize>, Vec<f64>)> {
    let of = |key: &str| format!("{path}.{key}");
    let places = joints.places(&yaml.texts(&of("joint_names"))?, &yaml.location(&of("joint_names")))?;
    let Some(input) = relative else { return Ok((places, Vec::new())) };
    let key = if input == "joint_pos" { "joint_pos_offsets" } else { "joint_vel_offsets" };
    let offset = yaml.numbers(&of(key))?;
    ensure!(
        offset.len() == places.len(),
        "{} has {} values, but joint_names {}",
        yaml.location(&of(key)),
        offset.len(),
        places.len()
    );
    Ok((places, offset))
}

/// Reads the only axis of a shape.
fn one(node: &Node) -> Option<usize> {
    let [len] = node.items() else { return None };
    count(len).filter(|len| *len > 0)
}
