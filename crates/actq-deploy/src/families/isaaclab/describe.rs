//! The description of a policy of Isaac Lab.

use std::collections::BTreeMap;

use actq::error::{Result, ensure};

use super::model::{Action, Kind, Layout, Policy, Sourced, Term, TermSource, parts_of};
use crate::description::{Description, Gains, Network, Op, Operand, Order, TargetKind};
use crate::facts::Facts;
use crate::families::common::{ACTION, Graph, Histories, Parts, given_gravity};

/// Most values of a term that the application computes.
const MAX_COUNT: usize = 1 << 16;
/// Names of values that this reader adds.
const RESERVED: [&str; 6] = [CLIPPED, "default", "observation", "processed", "target", "policy"];
/// Name of the action within its limit.
const CLIPPED: &str = "clipped_action";

/// A description under construction.
pub(super) struct Builder<'a> {
    pub(super) policy: &'a Policy,
    pub(super) graph: &'a Graph,
    /// Limit of the action, which the training's wrapper of the environment applies.
    pub(super) clip: Option<Sourced>,
    /// Name of the action that is fed back and becomes targets.
    pub(super) action: &'static str,
    pub(super) facts: &'a mut Facts,
}

impl Builder<'_> {
    /// Makes the description. `states` are inputs of the graph that no cell keeps, with the outputs that they take.
    pub(super) fn make(mut self, states: BTreeMap<String, String>) -> Result<Description> {
        let policy = self.policy;
        let mut parts = Parts::new("policy", policy.rate.numbers[0]);
        self.facts.note("rate_hz", policy.rate.from.clone());
        parts.joints("robot", policy.joints.names.clone());
        self.facts.note("joint order", policy.joints.from.clone());
        parts.constant("default", policy.default.numbers.clone());
        self.facts.note("default", policy.default.from.clone());
        self.raw_joints(&mut parts)?;
        self.check_actions()?;
        self.clip_action(&mut parts)?;
        self.observe(&mut parts)?;
        parts.wired(Network {
            name: "policy".to_owned(),
            file: self.graph.file.clone(),
            inputs: [(self.graph.input.clone(), "observation".to_owned())].into(),
            states,
        });
        parts.act(&format!("policy.{}", self.graph.output));
        self.targets(&mut parts)?;
        match policy.gains.clone() {
            Some([stiffness, damping]) => {
                self.facts.note("gains", format!("{}; {}", stiffness.from, damping.from));
                let joints = Some("robot".to_owned());
                parts.gains(Gains { joints, stiffness: stiffness.numbers, damping: damping.numbers });
            }
            None => self.facts.note("gains", "none: only the robot's USD file, or the code of its actuators, has them"),
        }
        Ok(parts.finish())
    }

    /// Adds the raw inputs of joints that terms or targets read.
    fn raw_joints(&mut self, parts: &mut Parts) -> Result<()> {
        let terms = &self.policy.terms;
        let is_relative = self.policy.actions.iter().any(|action| action.kind == Kind::Relative);
        let mut added = Vec::new();
        if is_relative {
            // Isaac Lab adds the positions of each step of the simulation.
            let key = "relative.once";
            let meaning = format!(
                "Isaac Lab adds a relative action to the joints' positions in each of the {} steps of a tick; should the image add it once per tick (true)?",
                self.policy.decimation
            );
            if self.policy.decimation > 1.0 {
                self.facts.require_from_application(key, &meaning)?;
            }
            added.push(("joint_pos", "rad"));
        }
        for term in terms {
            if let TermSource::Joints(input, unit) = term.what
                && !added.contains(&(input, unit))
            {
                added.push((input, unit));
            }
        }
        added.into_iter().for_each(|(input, unit)| parts.raw_joints(input, "robot", unit));
        Ok(())
    }

    /// Refuses actions that the graph does not give.
    fn check_actions(&self) -> Result<()> {
        let actions = &self.policy.actions;
        let total: usize = actions.iter().map(|action| action.joints.len()).sum();
        if total != self.graph.actions && !self.policy.joints.open {
            return Err(Facts::contradiction(
                "length of the action",
                (&actions[0].from, &format!("{total} joints")),
                (
                    &format!("{}: output {:?}", self.graph.file, self.graph.output),
                    &format!("{} values", self.graph.actions),
                ),
            ));
        }
        Ok(())
    }

    /// Adds the action within its limit, if it has one and the rule holds.
    fn clip_action(&mut self, parts: &mut Parts) -> Result<()> {
        let Some(limit) = self.clip.take() else { return Ok(()) };
        if self.facts.value_or_default("clip_actions")? {
            let limits = [-limit.numbers[0], limit.numbers[0]].map(Operand::Number);
            parts.value(CLIPPED, ACTION, vec![Op::Clip(limits)]);
            self.facts.note(CLIPPED, format!("{}; {}", limit.from, self.facts.source("clip_actions")));
            self.action = CLIPPED;
        }
        Ok(())
    }

    fn observe(&mut self, parts: &mut Parts) -> Result<()> {
        let policy = self.policy;
        let total: usize = policy.actions.iter().map(|action| action.joints.len()).sum();
        let lens = self.lens(total)?;
        let is_open = self.is_open();
        let clip_first: bool = self.facts.value_or_default("clip_first")?;
        let mut shown = Vec::new();
        for (term, len) in policy.terms.iter().zip(lens) {
            let (mut ops, source) = self.term(parts, term, len, total)?;
            let clip = term.clip.and_then(|limits| clip(&[limits]));
            if let Some(scale) = &term.scale {
                ensure!(
                    is_open || [1, len].contains(&scale.len()),
                    "{}: scale has {} values, and the term {len}",
                    term.from,
                    scale.len()
                );
            }
            let scale = term.scale.as_deref().map(|scale| Op::Scale(operand(scale)));
            let both = if clip_first { [clip, scale] } else { [scale, clip] };
            ops.extend(both.into_iter().flatten());
            let value = parts.term(ops, term.frames);
            self.facts.note(&value, source);
            shown.push((&term.name, len * term.frames));
        }
        let sum: usize = shown.iter().map(|(_, len)| len).sum();
        if sum != self.graph.input_len && !is_open {
            let shown: Vec<String> = shown.iter().map(|(name, len)| format!("{name} {len}")).collect();
            return Err(Facts::contradiction(
                "length of the observation (the descriptors lack terms whose function has none; add env.yaml, which has all)",
                (
                    &policy.terms.first().map_or(String::new(), |term| term.from.clone()),
                    &format!("{sum} values: {}", shown.join(", ")),
                ),
                (
                    &format!("{}: input {:?}", self.graph.file, self.graph.input),
                    &format!("{} values", self.graph.input_len),
                ),
            ));
        }
        let histories = if policy.terms.iter().any(|term| term.frames > 1) {
            self.histories()?
        } else {
            Histories { by_term: true, first: Default::default(), fill: Default::default(), stride: 1 }
        };
        parts.observe(&histories)
    }

    /// Returns the conventions of histories: the layout that a file states, or a rule.
    fn histories(&mut self) -> Result<Histories> {
        let key = "history.layout";
        let (by_term, from) = match &self.policy.layout {
            Some(Layout::Terms(from)) => (true, from.clone()),
            Some(Layout::Frames(from)) => (false, from.clone()),
            Some(Layout::Left(from)) => {
                let meaning = format!(
                    "the environment's group has history_order, which {from} leaves out: \"term\" (all frames of a term, then the next term), or \"frame\" (history_order \"time\")? Add env.yaml, which has it"
                );
                let layout: Option<String> = self.facts.missing(key, &meaning)?;
                let layout = layout.unwrap_or_else(|| "term".to_owned());
                ensure!(
                    ["term", "frame"].contains(&layout.as_str()),
                    "answer {key} = {layout:?}: give \"term\" or \"frame\""
                );
                (layout == "term", self.facts.source(key))
            }
            None => {
                // While it is a question, any layout will do that terms with different histories can have.
                let by_term = self.facts.is_choice(key, "term")? || self.facts.is_open(key);
                (by_term, self.facts.source(key))
            }
        };
        self.facts.note("observation", from);
        Histories::laid_out(by_term, self.facts)
    }

    /// Returns `true` if lengths depend on open questions.
    fn is_open(&self) -> bool {
        let unknown = |term: &Term| {
            matches!(term.what, TermSource::Unknown(..)) && self.facts.is_open(&format!("raw.{}", term.name))
        };
        self.policy.joints.open || self.policy.terms.iter().any(unknown)
    }

    /// Returns the terms' lengths; those that no file has are questions.
    fn lens(&mut self, total: usize) -> Result<Vec<usize>> {
        let terms = &self.policy.terms;
        let known: usize = terms.iter().filter_map(|term| Some(term.len(total)? * term.frames)).sum();
        let rest = self.graph.input_len.saturating_sub(known);
        let mut lens = Vec::new();
        for term in terms {
            let TermSource::Unknown(why, given) = &term.what else {
                lens.push(term.len(total).unwrap_or(1));
                continue;
            };
            let key = format!("raw.{}", term.name);
            let hint = match given {
                Some(len) => format!("{} says {len}", term.from),
                None => format!("{rest} of the graph's {} values are left", self.graph.input_len),
            };
            let meaning = format!("{why}; how many values of it does the application compute? ({hint})");
            let len: Option<usize> = self.facts.missing(&key, &meaning)?;
            if let (Some(answer), Some(given)) = (len, given)
                && answer != *given
            {
                return Err(Facts::contradiction(
                    &format!("length of {:?}", term.name),
                    (&format!("answer {key}"), &answer.to_string()),
                    (&term.from, &given.to_string()),
                ));
            }
            let len = len.or(*given).unwrap_or(1);
            ensure!((1..=MAX_COUNT).contains(&len), "{key} = {len}: give 1 to {MAX_COUNT}");
            lens.push(len);
        }
        Ok(lens)
    }

    /// Begins a term; returns the operations before its clip and scale, and where they are from.
    fn term(&mut self, parts: &mut Parts, term: &Term, len: usize, total: usize) -> Result<(Vec<Op>, String)> {
        let mut source = term.from.clone();
        let mut also = |facts: &Facts, rule: &str| source = format!("{source}; {}", facts.source(rule));
        let name =
            if RESERVED.contains(&term.name.as_str()) { format!("{}_term", term.name) } else { term.name.clone() };
        let ops = match &term.what {
            TermSource::Raw(input, len, unit) => parts.input_as(&name, input, *len, unit),
            TermSource::Unknown(..) => parts.input_as(&name, &name, len, ""),
            TermSource::Command(input, len, ranges) => {
                let unit = if *len == 3 { "m/s, m/s, rad/s" } else { "" };
                let mut ops = parts.input_as(&name, input, *len, unit);
                if let Some(ranges) = ranges {
                    if self.facts.value_or_default("clamp_commands")? {
                        ops.extend(clip(ranges));
                    }
                    also(self.facts, "clamp_commands");
                }
                ops
            }
            TermSource::Quaternion(input) => {
                let order: Option<String> = self.facts.value("quaternion")?;
                let unit = if order.as_deref() == Some("wxyz") { "w, x, y, z" } else { "x, y, z, w" };
                also(self.facts, "quaternion");
                parts.input_as(&name, input, 4, unit)
            }
            TermSource::Gravity => {
                let (input, len, ops) = given_gravity(self.facts, "gravity", "vector", "orientation")?;
                parts.input_as(&name, input, len, "");
                also(self.facts, "gravity");
                ops
            }
            TermSource::Joints(input, _) => {
                parts.begin(&name, input);
                let mut ops = self.select(&term.joints);
                if term.offset.iter().any(|offset| *offset != 0.0) {
                    let is_default = *input == "joint_pos" && term.offset == self.policy.default.numbers;
                    let offset = if is_default { Operand::Name("default".to_owned()) } else { operand(&term.offset) };
                    ops.push(Op::Subtract(offset));
                }
                ops
            }
            TermSource::LastAction(places) => {
                let is_processed = self.facts.is_choice("last_action", "processed")?;
                also(self.facts, "last_action");
                let next = if is_processed { "processed" } else { self.action };
                let ops = parts.state_term(&name, total, next);
                let select = places.iter().map(|places| Op::Select(Order::Places(places.clone())));
                ops.into_iter().chain(select).collect()
            }
        };
        Ok((ops, source))
    }

    /// Returns the operation that takes some of the robot's joints, unless they are all in its order.
    fn select(&self, places: &[usize]) -> Vec<Op> {
        let is_all = places.iter().copied().eq(0..self.policy.joints.len());
        (!is_all).then(|| Op::Select(Order::Places(places.to_vec()))).into_iter().collect()
    }

    /// Adds what is made of the action, one target for each of its parts.
    fn targets(&mut self, parts: &mut Parts) -> Result<()> {
        let actions = &self.policy.actions;
        let order: Option<String> = self.facts.value("action.clip")?;
        let mut made = Vec::new();
        for (i, (action, places)) in actions.iter().zip(parts_of(actions)).enumerate() {
            let suffix = if actions.len() == 1 { String::new() } else { format!("_{i}") };
            let processed = format!("processed{suffix}");
            let mut ops = Vec::new();
            if actions.len() > 1 {
                ops.push(Op::Select(Order::Places(places)));
            }
            let clip = action.clip.as_deref().and_then(clip);
            let (before, after) = if order.as_deref() == Some("action") { (clip, None) } else { (None, clip) };
            ops.extend(before);
            ops.extend([Op::Scale(operand(&action.scale)), Op::Add(operand(&action.offset))]);
            ops.extend(after);
            parts.value(&processed, self.action, ops);
            self.facts.note(&processed, format!("{}; {}", action.from, self.facts.source("action.clip")));
            self.target(parts, action, &processed, &suffix)?;
            made.push(processed);
        }
        if actions.len() > 1 {
            parts.values("processed", &made.iter().map(String::as_str).collect::<Vec<_>>());
        }
        Ok(())
    }

    fn target(&mut self, parts: &mut Parts, action: &Action, processed: &str, suffix: &str) -> Result<()> {
        let mut value = processed.to_owned();
        if action.kind == Kind::Relative {
            value = format!("target{suffix}");
            let current = format!("current{suffix}");
            parts.value(&current, "joint_pos", self.select(&action.joints));
            parts.value(&value, processed, vec![Op::Add(Operand::Name(current))]);
            self.facts.note(&value, action.from.clone());
        }
        let mut order = "robot".to_owned();
        if !self.select(&action.joints).is_empty() {
            order = format!("action{suffix}");
            parts.joints(&order, self.policy.joints.at(&action.joints).names);
        }
        let kind = match action.kind {
            Kind::Position | Kind::Relative => TargetKind::Position,
            Kind::Velocity => TargetKind::Velocity,
            Kind::Effort => TargetKind::Torque,
        };
        parts.target_joints(kind, &value, &order);
        self.limit(parts, action, kind)
    }

    /// Limits a target of positions to the joints' ranges, by the rule.
    fn limit(&mut self, parts: &mut Parts, action: &Action, kind: TargetKind) -> Result<()> {
        let Some(ranges) = &self.policy.limits else { return Ok(()) };
        let of = |given: &Sourced| action.joints.iter().map(|place| given.numbers[*place]).collect();
        let limits = ranges.each_ref().map(of);
        if kind == TargetKind::Position && self.facts.is_choice("target.limits", "range")? {
            parts.limit(limits);
            self.facts.note("limits", format!("{}; {}", ranges[0].from, self.facts.source("target.limits")));
        }
        Ok(())
    }
}

/// Returns one number if all are the same.
fn operand(numbers: &[f64]) -> Operand {
    match numbers {
        [first, rest @ ..] if rest.iter().all(|number| number == first) => Operand::Number(*first),
        _ => Operand::List(numbers.to_vec()),
    }
}

/// Returns limits as an operation, unless all are infinite.
fn clip(limits: &[[f64; 2]]) -> Option<Op> {
    let finite = |bound: f64| bound.clamp(f64::from(f32::MIN), f64::from(f32::MAX));
    let of = |i: usize| operand(&limits.iter().map(|pair| finite(pair[i])).collect::<Vec<_>>());
    limits.iter().flatten().any(|bound| bound.is_finite()).then(|| Op::Clip([of(0), of(1)]))
}
