//! The robot's MuJoCo file.

use actq::error::{Context as _, Error, Result, bail, ensure};
use actq::text::printable;
use roxmltree::{Node as Element, ParsingOptions};

use crate::bundle::Bundle;
use crate::facts::Facts;
use crate::family::Recognized;

/// Most elements and attributes of a MuJoCo file.
const MAX_XML_NODES: u32 = 100_000;
/// Most levels of its bodies.
const MAX_XML_LEVELS: usize = 256;

/// The policy's joints in a MuJoCo file.
pub(super) struct Robot {
    pub(super) file: String,
    /// Names of the policy's joints, in the order of `qpos`.
    pub(super) joints: Vec<String>,
    /// Their ranges in rad or m, where the file has one.
    pub(super) ranges: Vec<Option<[f64; 2]>>,
    /// Factor of angles to rad.
    angle: f64,
    /// Values of `qpos`: 7 of a free joint and 1 of another.
    values: usize,
    /// Values of `qpos` by the keyframe's name.
    keyframes: Vec<(String, Vec<f64>)>,
}

impl Robot {
    /// Returns `true` if a text looks as a MuJoCo file.
    pub(super) fn is_one(text: &str) -> bool {
        text.contains("<mujoco")
    }

    /// Reads the bundle's file, if it has one.
    pub(super) fn of(bundle: &Bundle, found: &Recognized, n: usize, facts: &mut Facts) -> Result<Option<Self>> {
        let file = match &found.others[..] {
            [] => return Ok(None),
            [file] => file,
            several => {
                let meaning = format!("which MuJoCo file is the robot's: {}?", several.join(", "));
                let file: Option<String> = facts.missing("robot.file", &meaning)?;
                let file = file.unwrap_or_else(|| several[0].clone());
                let there = several.iter().find(|other| **other == file);
                there.with_context(|| format!("robot.file = {file:?}: expected one of {}", several.join(", ")))?
            }
        };
        let mut robot = Self::parse(file, &bundle.text(file)?).with_context(|| file.clone())?;
        let all = robot.joints.len();
        if all < n {
            return Err(Facts::contradiction(
                "number of joints",
                (file, &format!("{all} joints with one axis")),
                (&found.networks[0], &format!("{n} actions")),
            ));
        }
        if all > n {
            let last: Option<bool> = facts.value("joints.last")?;
            ensure!(
                last != Some(false),
                "joints.last = false: {file} has {all} joints for {n} actions, and it is not known which"
            );
            facts.note("joint selection", format!("the last {n} of {all} joints; {}", facts.source("joints.last")));
            robot.joints.drain(..all - n);
            robot.ranges.drain(..all - n);
        }
        Ok(Some(robot))
    }

    fn parse(file: &str, text: &str) -> Result<Self> {
        let options = ParsingOptions { allow_dtd: false, nodes_limit: MAX_XML_NODES, ..ParsingOptions::default() };
        let document = roxmltree::Document::parse_with_options(text, options)
            .map_err(|error| Error::input(format!("not XML: {}", printable(&error.to_string()))))?;
        let root = document.root_element();
        ensure!(
            root.has_tag_name("mujoco"),
            "it is not a MuJoCo file: its element is <{}>",
            printable(root.tag_name().name())
        );
        for tag in ["include", "replicate", "attach", "composite", "flexcomp"] {
            let element = root.descendants().find(|element| element.has_tag_name(tag));
            if let Some(element) = element {
                let line = document.text_pos_at(element.range().start).row;
                bail!("line {line}: <{tag}> is not supported; save the compiled model with MuJoCo and use that file");
            }
        }
        // MuJoCo's default is degrees.
        let in_rad = children(root, "compiler").any(|compiler| compiler.attribute("angle") == Some("radian"));
        let angle = if in_rad { 1.0 } else { std::f64::consts::PI / 180.0 };
        let (joints, ranges, keyframes) = Default::default();
        let mut robot = Self { file: file.to_owned(), joints, ranges, angle, values: 0, keyframes };
        for worldbody in children(root, "worldbody") {
            robot.body(worldbody, 0)?;
        }
        ensure!(!robot.joints.is_empty(), "it has no joints");
        for key in children(root, "keyframe").flat_map(|keyframe| children(keyframe, "key")) {
            let (Some(name), Some(qpos)) = (key.attribute("name"), key.attribute("qpos")) else { continue };
            let number = |word: &str| word.parse().ok().filter(|number: &f64| number.is_finite());
            let numbers: Option<Vec<f64>> = qpos.split_whitespace().map(number).collect();
            let numbers =
                numbers.with_context(|| format!("keyframe {:?}: qpos must be finite numbers", printable(name)))?;
            robot.keyframes.push((name.to_owned(), numbers));
        }
        Ok(robot)
    }

    /// Adds a body's joints, then those of its bodies, which is MuJoCo's order.
    fn body(&mut self, body: Element<'_, '_>, level: usize) -> Result<()> {
        ensure!(level < MAX_XML_LEVELS, "bodies have more than {MAX_XML_LEVELS} levels");
        let mut bodies = Vec::new();
        self.own(body, level, &mut bodies)?;
        bodies.into_iter().try_for_each(|inner| self.body(inner, level + 1))
    }

    /// Adds the joints of a body or of a frame in it, and collects the bodies.
    fn own<'a, 'i>(&mut self, body: Element<'a, 'i>, level: usize, bodies: &mut Vec<Element<'a, 'i>>) -> Result<()> {
        ensure!(level < MAX_XML_LEVELS, "frames have more than {MAX_XML_LEVELS} levels");
        for element in body.children().filter(Element::is_element) {
            match element.tag_name().name() {
                "freejoint" => self.free()?,
                "joint" => self.joint(element)?,
                "frame" => self.own(element, level + 1, bodies)?,
                "body" => bodies.push(element),
                _ => {}
            }
        }
        Ok(())
    }

    /// Adds a free joint. The policy's joints are the last values of `qpos`, so it must be before them.
    fn free(&mut self) -> Result<()> {
        ensure!(self.joints.is_empty(), "a body with a free joint follows the robot's joints; remove it from the file");
        self.values += 7;
        Ok(())
    }

    fn joint(&mut self, joint: Element<'_, '_>) -> Result<()> {
        let name = joint.attribute("name").unwrap_or_default();
        match joint.attribute("type").unwrap_or("hinge") {
            "free" => self.free()?,
            kind @ ("hinge" | "slide") => {
                self.values += 1;
                let factor = if kind == "hinge" { self.angle } else { 1.0 };
                self.ranges.push(range(joint, factor)?);
                ensure!(!name.is_empty(), "joint {} has no name", self.joints.len());
                self.joints.push(name.to_owned());
            }
            other => bail!("joint {:?}: type {:?} is not supported", printable(name), printable(other)),
        }
        Ok(())
    }

    /// Returns the policy's joints in a keyframe, which are the last values of its `qpos`.
    pub(super) fn keyframe(&self, name: &str) -> Result<Option<Vec<f64>>> {
        let Some((_, qpos)) = self.keyframes.iter().find(|(key, _)| key == name) else { return Ok(None) };
        if qpos.len() != self.values {
            return Err(Facts::contradiction(
                "length of qpos",
                (&format!("{}: keyframe {name:?}", self.file), &qpos.len().to_string()),
                (&format!("{}: worldbody", self.file), &format!("{} values of its joints", self.values)),
            ));
        }
        Ok(qpos.len().checked_sub(self.joints.len()).map(|first| qpos[first..].to_vec()))
    }
}

/// Reads a joint's range, unless the file says that it does not hold.
fn range(joint: Element<'_, '_>, factor: f64) -> Result<Option<[f64; 2]>> {
    let Some(text) = joint.attribute("range").filter(|_| joint.attribute("limited") != Some("false")) else {
        return Ok(None);
    };
    let numbers: Option<Vec<f64>> = text.split_whitespace().map(|word| word.parse().ok()).collect();
    let pair = numbers.and_then(|numbers| <[f64; 2]>::try_from(numbers).ok());
    let pair = pair.filter(|[low, high]| low <= high && low.is_finite() && high.is_finite());
    let name = printable(joint.attribute("name").unwrap_or_default());
    let pair = pair.with_context(|| {
        format!("joint {name:?}: range = {:?} must be two numbers, the lowest first", printable(text))
    })?;
    Ok(Some(pair.map(|bound| bound * factor)))
}

fn children<'a, 'i>(element: Element<'a, 'i>, tag: &'static str) -> impl Iterator<Item = Element<'a, 'i>> {
    element.children().filter(move |child| child.has_tag_name(tag))
}
