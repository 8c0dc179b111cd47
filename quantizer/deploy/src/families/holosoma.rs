//! holosoma: one ONNX file, whose metadata have the joints' names and gains, and from release 0.0.3 on the observation.

mod layout;

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::{PI, TAU};

use actq::error::{Context as _, Result, ensure};
use actq_onnx::Signature;

use self::layout::{CLIP, Entry, LAYOUT, entries};
use super::common::action::{add_zero, clip, clip_to, fed_back, padded};
use super::common::terms::given;
use super::common::{Histories, Parts, Ports, given_gravity};
use crate::bundle::Bundle;
use crate::description::{Clock, Description, Fill, First, Gains, Op, Operand, Standing, TargetKind, When};
use crate::document::Document;
use crate::facts::Facts;
use crate::family::{Family, Found};
use crate::yaml::{Data, Node};

/// Reader of holosoma bundles.
#[derive(Debug)]
pub(super) struct Holosoma;

/// Keys of the metadata that every file of this family has.
const KEYS: [&str; 3] = ["dof_names", "kp", "kd"];
/// Terms whose scale differs between the family's policies; the rule `scales.other` is that of all others.
const SCALED: [&str; 3] = ["base_ang_vel", "base_lin_vel", "dof_vel"];

/// Kinds of policies: the rule that lists a kind's terms, and the terms that are placeholders while it is a question.
struct Kind {
    rule: &'static str,
    terms: &'static [&'static str],
}

const LOCOMOTION: Kind = Kind {
    rule: "terms",
    terms: &[
        "actions",
        "base_ang_vel",
        "command_ang_vel",
        "command_lin_vel",
        "cos_phase",
        "dof_pos",
        "dof_vel",
        "projected_gravity",
        "sin_phase",
    ],
};
const TRACKING: Kind = Kind {
    rule: "tracking.terms",
    terms: &["actions", "base_ang_vel", "dof_pos", "dof_vel", "motion_command", "motion_ref_ori_b"],
};

impl Family for Holosoma {
    fn profile(&self) -> &'static str {
        include_str!("holosoma/profile.toml")
    }

    fn recognize(&self, bundle: &Bundle) -> Result<Option<Found>> {
        let (mut networks, mut documents) = (Vec::new(), Vec::new());
        for file in bundle.with_ending("onnx") {
            // A file that is not ONNX decides nothing.
            let Ok(Signature { metadata, .. }) = bundle.signature(file) else { continue };
            if KEYS.iter().all(|key| metadata.contains_key(*key)) {
                networks.push(file.to_owned());
                documents.push(Document::of(&format!("{file} metadata"), Node { line: 1, data: parsed(metadata) }));
            }
        }
        ensure!(networks.len() <= 1, "several files are policies: {}; name one of them", networks.join(", "));
        Ok((!networks.is_empty()).then(|| Found { documents, networks, others: Vec::new() }))
    }

    fn read(&self, bundle: &Bundle, found: &Found, facts: &mut Facts) -> Result<Description> {
        let file = found.networks.first().context("there is no ONNX file")?;
        let metadata = found.documents.first().context("there are no metadata")?;
        let signature = bundle.signature(file)?;
        let joints = joint_names(metadata)?;
        let gains = gains(metadata, joints.len())?;
        let n = joints.len();
        let kind = if signature.inputs.iter().any(|(name, _)| name == "time_step") { TRACKING } else { LOCOMOTION };
        let ports = ports(file, &signature)?;
        // A graph whose axes are all dynamic has no fixed lengths.
        let action_len = ports.action_len.filter(|len| *len > 1).unwrap_or(n);
        if action_len > n {
            return Err(Facts::contradiction(
                "length of the action",
                (&metadata.location("dof_names"), &format!("{n} names")),
                (&format!("{file}, output {:?}", ports.output), &format!("{action_len} values")),
            ));
        }

        let rate = facts.positive("rate_hz")?;
        let default: Option<Vec<f64>> = facts.value("default")?;
        let default = default.unwrap_or_else(|| vec![0.0; n]);
        ensure!(
            default.len() == n,
            "default has {} values, but {} has {n} names",
            default.len(),
            metadata.location("dof_names")
        );
        let mut reader = Reader { parts: Parts::new("policy", rate), facts, n, action_len, rate, has_clock: false };
        reader.parts.joints("robot", joints);
        reader.parts.constant("default", default);
        let (len, source) = match entries(metadata)? {
            Some(entries) => (reader.observe_stated(metadata, &kind, &entries)?, metadata.location(LAYOUT)),
            None => (reader.observe(&kind)?, format!("{} ({})", kind.rule, reader.facts.source(kind.rule))),
        };
        if let Some(fixed) = ports.observation_len.filter(|fixed| *fixed > 1 && *fixed != len)
            && !reader.facts.is_open(kind.rule)
        {
            return Err(Facts::contradiction(
                "length of the observation",
                (&format!("{file}, input {:?}", ports.input), &format!("{fixed} values")),
                (&source, &format!("{len} values of {n} joints")),
            ));
        }
        reader.parts.network(file, &ports.input, &ports.output);
        reader.act(metadata)?;
        reader.parts.gains(gains);
        reader.facts.note("gains", metadata.location("kp"));
        reader.facts.note("joints.robot", metadata.location("dof_names"));
        Ok(reader.parts.finish())
    }
}

/// Reads the joints' names, which must differ.
fn joint_names(metadata: &Document) -> Result<Vec<String>> {
    let joints = metadata.texts("dof_names")?;
    let distinct = joints.iter().collect::<BTreeSet<_>>().len();
    ensure!(!joints.is_empty(), "{} is empty", metadata.location("dof_names"));
    ensure!(distinct == joints.len(), "{}: a name occurs twice", metadata.location("dof_names"));
    Ok(joints)
}

/// Reads the gains of `n` joints.
fn gains(metadata: &Document, n: usize) -> Result<Gains> {
    let (stiffness, damping) = (metadata.numbers("kp")?, metadata.numbers("kd")?);
    for (key, list) in [("kp", &stiffness), ("kd", &damping)] {
        if list.len() != n {
            return Err(Facts::contradiction(
                "number of joints",
                (&metadata.location("dof_names"), &format!("{n} names")),
                (&metadata.location(key), &format!("{} gains", list.len())),
            ));
        }
    }
    Ok(Gains { joints: Some("robot".to_owned()), stiffness, damping })
}

/// Returns `true` if [`Reader::term`] knows a function of holosoma.
fn is_known(function: &str) -> bool {
    const OWN: [&str; 6] = ["dof_pos", "dof_vel", "projected_gravity", "actions", "sin_phase", "cos_phase"];
    const MOTION: [&str; 3] = ["motion_command", "motion_ref_pos_b", "motion_ref_ori_b"];
    OWN.contains(&function) || MOTION.contains(&function) || given(function).is_some()
}

/// Finds the observation's input and the action's output.
///
/// A tracking policy's file also has inputs and outputs of the motion, which its action does not depend on.
fn ports(file: &str, signature: &Signature) -> Result<Ports> {
    let find = |names: [&str; 2], ports: &[(String, Option<usize>)]| match ports {
        [one] => Some(one.clone()),
        several => several.iter().find(|(name, _)| names.contains(&name.as_str())).cloned(),
    };
    let input = find(["actor_obs", "obs"], &signature.inputs);
    let output = find(["action", "actions"], &signature.outputs);
    let (input, observation_len) = input.with_context(|| format!("{file}: it has no input actor_obs or obs"))?;
    let (output, action_len) = output.with_context(|| format!("{file}: it has no output action or actions"))?;
    Ok(Ports { input, output, observation_len, action_len })
}

/// Parses the texts of metadata, which are JSON and so YAML. What cannot be parsed stays a text.
fn parsed(metadata: BTreeMap<String, String>) -> Data {
    let entry = |(key, text): (String, String)| {
        let node = Node::parse(&text).map(Node::numbered);
        (key, node.unwrap_or(Node { line: 1, data: Data::Scalar(text, true) }))
    };
    Data::Map(metadata.into_iter().map(entry).collect())
}

/// Reads a number, or several in a list or a text with commas.
fn numbers(node: &Node) -> Option<Vec<f64>> {
    let parts = || node.text()?.split(',').map(|part| part.trim().parse().ok()).collect();
    let list: Vec<f64> = node.numbers().or_else(parts)?;
    (!list.is_empty() && list.iter().all(|number| number.is_finite())).then_some(list)
}

/// A description under construction.
struct Reader<'a> {
    parts: Parts,
    facts: &'a mut Facts,
    /// Number of joints.
    n: usize,
    /// Length of the action.
    action_len: usize,
    rate: f64,
    has_clock: bool,
}

impl Reader<'_> {
    /// Adds the observation; returns its length.
    fn observe(&mut self, kind: &Kind) -> Result<usize> {
        let key = kind.rule;
        let terms: Option<Vec<String>> = self.facts.value(key)?;
        let mut terms = terms.unwrap_or_else(|| kind.terms.iter().map(|&term| term.to_owned()).collect());
        if !self.facts.is_choice("order", "listed")? {
            terms.sort();
        }
        let length: usize = self.facts.value("history.length")?.unwrap_or(1);
        ensure!((1..=1000).contains(&length), "history.length = {length}: give 1 to 1000");
        let histories = if length > 1 {
            Histories::of(self.facts)?
        } else {
            Histories { by_term: true, first: Default::default(), fill: Default::default(), stride: 1 }
        };
        let mut all = 0;
        for (i, name) in terms.iter().enumerate() {
            ensure!(!terms.iter().take(i).any(|other| other == name), "{key}: {name:?} occurs twice");
            let (from, mut ops, len) = self.term(name)?;
            let scale = format!("scales.{name}");
            let by: f64 = if SCALED.contains(&name.as_str()) {
                self.facts.value(&scale)?.unwrap_or(1.0)
            } else {
                self.facts.value("scales.other")?.unwrap_or(1.0)
            };
            ops.push(Op::Scale(Operand::Number(by)));
            let rule = if SCALED.contains(&name.as_str()) { scale.as_str() } else { "scales.other" };
            self.parts.begin(name, &from);
            let value = self.parts.term(ops, length);
            self.facts.note(&value, self.facts.source(rule));
            all += len;
        }
        self.parts.observe(&histories)?;
        let sources = [key, "order", "history.length"].map(|rule| self.facts.source(rule));
        self.facts.note("observation", sources.join("; "));
        all.checked_mul(length).context("the observation is too long")
    }

    /// Adds the observation that the metadata state; returns its length. Answers to what they state must agree.
    fn observe_stated(&mut self, metadata: &Document, kind: &Kind, entries: &[Entry]) -> Result<usize> {
        let at = metadata.location(LAYOUT);
        let names: Vec<String> = entries.iter().map(|entry| entry.name.clone()).collect();
        self.facts.agrees(kind.rule, &names, &at)?;
        self.facts.agrees("order", &"listed".to_owned(), &at)?;
        self.facts.agrees("history.layout", &"term".to_owned(), &at)?;
        self.facts.agrees("history.first", &First::Oldest, &at)?;
        self.facts.agrees("history.fill", &Fill::Zero, &at)?;
        let mut all = 0;
        for (i, entry) in entries.iter().enumerate() {
            let (from, mut ops, len) = match entry.function() {
                Some(function) if !entry.has_params && is_known(function) => self.term(function)?,
                _ => {
                    let meaning = format!(
                        "{}: the reader does not know {} with its parameters; does the application compute its {} values?",
                        entry.at, entry.func, entry.dim
                    );
                    self.facts.of_application(&format!("raw.{}", entry.name), &meaning)?;
                    self.parts.raw(&entry.name, entry.dim, "");
                    (entry.name.clone(), Vec::new(), entry.dim)
                }
            };
            if len != entry.dim {
                return Err(Facts::contradiction(
                    &format!("length of the term {:?}", entry.name),
                    (&format!("{}.dim", entry.at), &entry.dim.to_string()),
                    (&format!("the joints of {}", metadata.location("dof_names")), &len.to_string()),
                ));
            }
            let rule = if SCALED.contains(&entry.name.as_str()) { entry.name.as_str() } else { "other" };
            if let [scale] = entry.scale[..] {
                self.facts.agrees(&format!("scales.{rule}"), &scale, &entry.at)?;
            }
            self.facts.agrees("history.length", &entry.frames, &entry.at)?;
            ops.push(Op::Scale(match entry.scale[..] {
                [one] => Operand::Number(one),
                _ => Operand::List(entry.scale.clone()),
            }));
            ops.extend(entry.clip.map(|limits| Op::Clip(limits.map(Operand::Number))));
            // Terms of two groups may have one name.
            let is_taken = entries[..i].iter().any(|other| other.name == entry.name);
            let name = if is_taken { format!("{}_{}", entry.group, entry.name) } else { entry.name.clone() };
            self.parts.begin(&name, &from);
            let value = self.parts.term(ops, entry.frames);
            self.facts.note(&value, entry.at.clone());
            all += len * entry.frames;
        }
        // The format of the layout is oldest first, with zeros before the first frame.
        self.parts.observe(&Histories { by_term: true, first: First::Oldest, fill: Fill::Zero, stride: 1 })?;
        let limit = metadata.optional(CLIP, "a number above 0", |node| node.number().filter(|limit| *limit > 0.0))?;
        if let Some(limit) = limit {
            self.parts.observed(clip_to(limit));
        }
        self.facts.note("observation", format!("{at}; {}", metadata.location(CLIP)));
        Ok(all)
    }

    /// Returns the value that a term is made of, the operations on it, and its length.
    fn term(&mut self, name: &str) -> Result<(String, Vec<Op>, usize)> {
        let n = self.n;
        let known = match name {
            // The orientation of the reference body needs the robot's kinematics.
            "motion_command" => Some((2 * n, "rad, rad/s")),
            "motion_ref_pos_b" => Some((3, "m")),
            "motion_ref_ori_b" => Some((6, "")),
            _ => given(name),
        };
        if let Some((len, unit)) = known {
            self.parts.raw(name, len, unit);
            return Ok((name.to_owned(), Vec::new(), len));
        }
        Ok(match name {
            "dof_pos" => {
                self.parts.raw_joints(name, "robot", "rad");
                (name.to_owned(), vec![Op::Subtract(Operand::Name("default".to_owned()))], n)
            }
            "dof_vel" => {
                self.parts.raw_joints(name, "robot", "rad/s");
                (name.to_owned(), Vec::new(), n)
            }
            "projected_gravity" => self.gravity()?,
            "actions" => {
                fed_back(&mut self.parts, self.action_len, self.facts)?;
                ("last_action".to_owned(), Vec::new(), self.action_len)
            }
            "sin_phase" => ("leg_phases".to_owned(), vec![Op::Sin], self.clock()?),
            "cos_phase" => ("leg_phases".to_owned(), vec![Op::Cos], self.clock()?),
            other => {
                // Only the application knows this term, so it becomes a raw input.
                let len: Option<usize> = self.facts.missing(
                    &format!("raw.{other}"),
                    &format!("term {other:?}: unknown length; how many values does the application give?"),
                )?;
                let len = len.unwrap_or(1);
                ensure!((1..=10_000).contains(&len), "raw.{other} = {len}: give 1 to 10000");
                self.parts.raw(other, len, "");
                (other.to_owned(), Vec::new(), len)
            }
        })
    }

    fn gravity(&mut self) -> Result<(String, Vec<Op>, usize)> {
        let (name, len, ops) = given_gravity(self.facts, "gravity", "rpy", "base_quat")?;
        self.parts.raw(name, len, "");
        self.facts.note(name, self.facts.source("gravity"));
        Ok((name.to_owned(), ops, 3))
    }

    /// Adds the phases of the legs, unless they are there; returns their number.
    fn clock(&mut self) -> Result<usize> {
        let start: Option<Vec<f64>> = self.facts.value("clock.start")?;
        let start = start.unwrap_or_else(|| vec![0.0, PI]);
        let legs = start.len();
        if self.has_clock {
            return Ok(legs);
        }
        self.has_clock = true;
        let period = self.facts.positive("gait_period")?;
        let below: f64 = self.facts.value_or_default("clock.standing_below")?;
        let at: Option<Vec<f64>> = self.facts.value("clock.standing_at")?;
        let of = [("command_lin_vel", 2, "m/s"), ("command_ang_vel", 1, "rad/s")];
        for (name, len, unit) in of {
            self.parts.raw(name, len, unit);
        }
        self.parts.clock(Clock {
            name: "leg_phases".to_owned(),
            start,
            advance: TAU / (self.rate * period),
            when: self.facts.value("clock.when")?.unwrap_or(When::Before),
            wrap: Some([-PI, PI]),
            restart_above: None,
            standing: Some(Standing {
                of: of.iter().map(|(name, ..)| (*name).to_owned()).collect(),
                below,
                at: at.unwrap_or_else(|| vec![PI; legs]),
            }),
        });
        let source = format!("{}; {}", self.facts.source("gait_period"), self.facts.source("clock.start"));
        self.facts.note("leg_phases", source);
        Ok(legs)
    }

    /// Adds the target: the default and the scaled action; 0 for the first joints of an action that is shorter.
    fn act(&mut self, metadata: &Document) -> Result<()> {
        let (n, action_len) = (self.n, self.action_len);
        clip(&mut self.parts, self.facts)?;
        let (scale, source) = match metadata.optional("action_scale", "a finite number, or several", numbers)? {
            Some(scale) => {
                let at = metadata.location("action_scale");
                if let [one] = scale[..] {
                    self.facts.agrees("action_scale", &one, &at)?;
                }
                (scale, at)
            }
            None => {
                let scale: f64 = self.facts.value_or_default("action_scale")?;
                (vec![scale], self.facts.source("action_scale"))
            }
        };
        ensure!(
            scale.len() == 1 || scale.len() == n,
            "{} has {} values; 1 or {n} are needed",
            metadata.location("action_scale"),
            scale.len()
        );
        let mut ops = Vec::new();
        let mut from = "clipped";
        if action_len < n {
            let first: bool = self.facts.value("action.last_joints")?.unwrap_or(true);
            let moved = if first { n - action_len..n } else { 0..action_len };
            add_zero(&mut self.parts, "clipped");
            self.facts.note("clipped_and_zero", self.facts.source("action.last_joints"));
            ops.push(padded(n, moved));
            from = "clipped_and_zero";
        }
        ops.push(Op::Scale(match scale[..] {
            [one] => Operand::Number(one),
            _ => Operand::List(scale),
        }));
        ops.push(Op::Add(Operand::Name("default".to_owned())));
        self.parts.value("target", from, ops);
        self.facts.note("target", format!("{source}; {}", self.facts.source("default")));
        self.parts.target_joints(TargetKind::Position, "target", "robot");
        Ok(())
    }
}
