//! The terms of an observation.

use std::f64::consts::TAU;

use actq::error::{Result, bail};

use super::super::common::action::fed_back;
use super::super::common::given_gravity;
use super::super::common::terms::given;
use super::reader::{Reader, Term};
use crate::description::{Op, Operand, Order};
use crate::facts::Facts;
use crate::yaml::Node;

impl Reader<'_> {
    /// Makes a term with its scale.
    pub(super) fn term(&mut self, name: &str) -> Result<Term> {
        let (yaml, n) = (self.yaml, self.robot.len());
        let dim = self.dim(name)?;
        let mut term = self.content(name, dim)?;
        if term.stated != dim {
            let what = match name {
                "actions" => self.action_len_from.clone(),
                "ref_upper_dof_pos" => yaml.location("dof_names_upper_body"),
                _ => format!("the deploy code, for {n} joints"),
            };
            return Err(Facts::contradiction(
                &format!("length of {name}"),
                (&yaml.location(&format!("{}.{name}", self.dims)), &format!("{dim} values")),
                (&what, &format!("{} values", term.stated)),
            ));
        }
        let key = format!("obs_scales.{name}");
        let scale = yaml.required(&key, "a number, or a list of them", |node| {
            Some(match node.number() {
                Some(number) => Operand::Number(number),
                None => Operand::List(node.numbers()?),
            })
        })?;
        term.ops.push(Op::Scale(scale));
        Ok(term)
    }

    fn content(&mut self, name: &str, dim: usize) -> Result<Term> {
        if let Some((len, unit)) = given(name) {
            return Ok(self.raw(name, len, unit));
        }
        let n = self.robot.len();
        let from = |from: &str, ops: Vec<Op>, len: usize| Term { from: from.to_owned(), ops, len, stated: len };
        Ok(match name {
            "ref_upper_dof_pos" => self.raw(name, self.robot.upper.len(), "rad"),
            "projected_gravity" => self.gravity()?,
            "dof_pos" | "dof_vel" => {
                let unit = if name == "dof_pos" { "rad" } else { "rad/s" };
                if self.robot.by_name {
                    self.parts.raw_joints(name, "robot", unit);
                } else {
                    self.parts.raw(name, n, unit);
                }
                let mut ops = Vec::new();
                if name == "dof_pos" {
                    ops.push(Op::Subtract(Operand::Name("default".to_owned())));
                }
                let mut len = n;
                if let Some(active) = &self.active {
                    ops.push(Op::Select(Order::Places(active.clone())));
                    len = active.len();
                }
                Term { stated: n, ..from(name, ops, len) }
            }
            "actions" => {
                let action_len = self.action_len.unwrap_or(dim);
                fed_back(&mut self.parts, action_len, self.facts)?;
                // The file states the number of all joints for a policy that moves a selection of them.
                let stated = if self.active.is_some() { n } else { action_len };
                Term { stated, ..from("last_action", Vec::new(), action_len) }
            }
            "phase_time" => from(&self.phase()?, Vec::new(), 1),
            "sin_phase" => from(&self.phase()?, vec![Op::Scale(Operand::Number(TAU)), Op::Sin], 1),
            "cos_phase" => from(&self.phase()?, vec![Op::Scale(Operand::Number(TAU)), Op::Cos], 1),
            "ref_motion_phase" => self.motion_phase()?,
            other => {
                // Only the application knows this term, so it becomes a raw input.
                self.facts.require_from_application(
                    &format!("raw.{other}"),
                    &format!("term {other:?} is not known to this reader; does the application compute it (true)?"),
                )?;
                self.raw(other, dim, "")
            }
        })
    }

    fn gravity(&mut self) -> Result<Term> {
        let booster = match self.yaml.optional("SDK_TYPE", "a text", Node::text)? {
            Some("booster") => true,
            Some("unitree") | None => false,
            Some(other) => bail!("{}: {other:?} is unknown; use unitree or booster", self.yaml.location("SDK_TYPE")),
        };
        let rule = if booster { "gravity.booster" } else { "gravity.unitree" };
        let (name, len, ops) = given_gravity(self.facts, rule, "wxyz", "base_quat")?;
        let raw = self.raw(name, len, "");
        self.facts.note(name, self.facts.source(rule));
        Ok(Term { ops, len: 3, stated: 3, ..raw })
    }
}
