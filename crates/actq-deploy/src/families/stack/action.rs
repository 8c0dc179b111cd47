//! The target, and the gains of its joints.

use actq::error::{Context as _, Result, ensure};

use super::super::common::action::{add_zero, clip_to, padded};
use super::super::common::{ACTION, counts};
use super::Reader;
use super::observation::{Ports, operand};
use super::values::SEVERAL;
use crate::description::{Gains, Op, Operand, Order};
use crate::facts::Facts;

impl Reader<'_> {
    /// Refuses an action of other joints.
    pub(super) fn check_action(&self, ports: &Ports) -> Result<()> {
        let (action, n) = (&self.schema.action, self.robot.len);
        if self.action_len > n || (self.action_len < n && action.last_joints.is_none()) {
            return Err(Facts::contradiction(
                "length of the action",
                (&self.robot.at, &format!("{n} joints")),
                (&ports.action_at, &format!("{} values", self.action_len)),
            ));
        }
        Ok(())
    }

    /// Adds the target: the action within its limit, scaled, with its offset, in the order of the raw values.
    pub(super) fn act(&mut self) -> Result<()> {
        let (action, n) = (&self.schema.action, self.robot.len);
        let document = self.values.document;
        let (kind, mut sources) = match &action.key {
            Some(key) => {
                let path = self.values.path(&format!("{key}.*"), "")?;
                let name = path.rsplit('.').next().unwrap_or_default();
                let kind = action.kinds.get(name);
                (
                    kind.copied().with_context(|| format!("{}: action {name} is not known", document.location(key)))?,
                    vec![document.location(&path)],
                )
            }
            None => {
                (action.kind.with_context(|| format!("profile {}: the action has no kind", self.family))?, Vec::new())
            }
        };
        if let Some(key) = &action.joints {
            let path = self.values.path(key, "")?;
            let places = document.peek(&path).and_then(counts);
            if places.is_none_or(|places| places.into_iter().eq(0..n)) {
                document.node(&path);
            }
        }
        let mut from = ACTION;
        if let Some(limit) = &action.limit {
            let (limit, at) = self.values.one(limit, "", 100.0)?;
            self.parts.value("clipped", from, vec![clip_to(limit)]);
            self.values.facts.note("clipped", at);
            from = "clipped";
        }
        let mut ops = Vec::new();
        if let Some(rule) = action.last_joints.as_ref().filter(|_| self.action_len < n) {
            let last = self.values.facts.value(rule)?.unwrap_or(true);
            add_zero(&mut self.parts, from);
            self.values.facts.note("clipped_and_zero", self.values.facts.source(rule));
            ops.push(padded(n, if last { n - self.action_len..n } else { 0..self.action_len }));
            from = "clipped_and_zero";
        }
        for (source, op) in [(&action.scale, Op::Scale as fn(Operand) -> Op), (&action.offset, Op::Add)] {
            let Some(source) = source else { continue };
            let (list, at) = self.values.list(source, "")?.unwrap_or_else(|| (vec![1.0], "a question".to_owned()));
            ensure!([1, n].contains(&list.len()), "{at} has {} values; 1 or {n} are needed", list.len());
            sources.push(at);
            ops.push(op(operand(list)));
        }
        if action.relative {
            ops.push(Op::Add(Operand::Name("default".to_owned())));
            sources.push(self.values.facts.source("default"));
        }
        if let Some(clip) = &action.clip {
            let path = self.values.path(clip, "")?;
            if let Some(limits) = self.values.pairs(&path)? {
                sources.push(document.location(&path));
                ops.push(Op::Clip(limits.map(operand)));
            }
        }
        let processed = self.processed();
        self.parts.value(processed, from, ops);
        self.values.facts.note(processed, sources.join("; "));
        if let Some(map) = &self.robot.map {
            self.parts.value("target", processed, vec![Op::Place(Order::Places(map.clone()))]);
            sources.extend(self.schema.joints.map.as_ref().map(|key| document.location(key)));
            self.values.facts.note("target", sources.join("; "));
        }
        if self.robot.is_named {
            self.parts.target_joints(kind, "target", "robot");
        } else {
            self.parts.target(kind, "target");
        }
        Ok(())
    }

    /// Returns the name of the action with scale and offset, in the policy's order.
    pub(super) fn processed(&self) -> &'static str {
        if self.robot.map.is_some() { "processed" } else { "target" }
    }

    /// Adds the gains, in the order of the raw values.
    pub(super) fn gains(&mut self) -> Result<()> {
        let keys = &self.schema.joints;
        let (Some(stiffness), Some(damping)) = (&keys.stiffness, &keys.damping) else { return Ok(()) };
        let of_policy = match &keys.gains_order {
            Some(rule) => self.values.facts.is_choice(rule, "policy")?,
            None => true,
        };
        let mut lists = Vec::new();
        for source in [stiffness, damping] {
            self.values.require(source, "", SEVERAL)?;
            let n = self.robot.len;
            let (list, at) = self.values.list(source, "")?.unwrap_or_else(|| (vec![0.0], "a question".to_owned()));
            let list = if self.values.is_single(source)? { vec![list[0]; n] } else { list };
            if list.len() != n {
                return Err(Facts::contradiction(
                    "number of joints",
                    (&self.robot.at, &format!("{n} joints")),
                    (&at, &format!("{} gains", list.len())),
                ));
            }
            let mut ordered = list.clone();
            if let Some(map) = self.robot.map.as_ref().filter(|_| of_policy) {
                map.iter().zip(&list).for_each(|(place, gain)| ordered[*place] = *gain);
            }
            lists.push((ordered, at));
        }
        let [(stiffness, at), (damping, _)] = <[_; 2]>::try_from(lists).ok().context("two lists of gains")?;
        let order =
            keys.gains_order.as_ref().map_or_else(String::new, |rule| format!("; {}", self.values.facts.source(rule)));
        self.values.facts.note("gains", format!("{at}{order}"));
        let joints = self.robot.is_named.then(|| "robot".to_owned());
        self.parts.gains(Gains { joints, stiffness, damping });
        Ok(())
    }
}
