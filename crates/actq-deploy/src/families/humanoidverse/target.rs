//! The target, and the gains of its joints.

use actq::error::{Result, ensure};

use super::super::common::action::{add_zero, clip, padded};
use super::reader::Reader;
use crate::description::{Gains, Op, Operand, Order, TargetKind};
use crate::facts::Facts;
use crate::yaml::Node;

impl Reader<'_> {
    /// Adds the target: the action, scaled, with what the upper body gets, relative to the default.
    pub(super) fn act(&mut self) -> Result<()> {
        let (yaml, n) = (self.yaml, self.robot.len());
        clip(&mut self.parts, self.facts)?;
        let scale: f64 = self.facts.value_or_default("action_scale")?;
        let scaled = || Op::Scale(Operand::Number(scale));
        let action_len = self.action_len.unwrap_or(n);
        let mut source = self.facts.source("action_scale");
        let mut ops = Vec::new();
        let from = if let Some(active) = self.active.clone() {
            if active.len() != action_len {
                return Err(self.wrong_action(action_len, active.len(), "robot_dofs"));
            }
            let places = (0..n).map(|i| active.iter().position(|place| *place == i).unwrap_or(action_len)).collect();
            add_zero(&mut self.parts, "clipped");
            ops.extend([Op::Select(Order::Places(places)), scaled()]);
            "clipped_and_zero".to_owned()
        } else if action_len == n {
            ops.push(scaled());
            let key = "residual_upper_body_action";
            if yaml.optional(key, "True or False", Node::truth)?.unwrap_or(false) {
                self.residual()?;
                ops.push(Op::Add(Operand::Name("residual".to_owned())));
                source = format!("{source}; {}; {}", yaml.location(key), self.facts.source("residual"));
            }
            "clipped".to_owned()
        } else if action_len < n {
            self.short(action_len, scaled())?
        } else {
            return Err(self.wrong_action(action_len, n, "DEFAULT_DOF_ANGLES"));
        };
        ops.push(Op::Add(Operand::Name("default".to_owned())));
        let limits = ["motor_pos_lower_limit_list", "motor_pos_upper_limit_list"];
        let lists = limits.map(|key| yaml.optional(key, "a list of finite numbers", Node::numbers));
        let [low, high] = lists;
        if let (Some(low), Some(high)) = (low?, high?)
            && !low.is_empty()
            && !high.is_empty()
            && self.facts.value("target.clip")?.unwrap_or(true)
        {
            for (key, list) in limits.iter().zip([&low, &high]) {
                ensure!(
                    list.len() == n,
                    "{} has {} values; {n} are needed, one for each joint",
                    yaml.location(key),
                    list.len()
                );
            }
            ops.push(Op::Clip([Operand::List(low), Operand::List(high)]));
            source = format!("{source}; {}", yaml.location(limits[0]));
        }
        self.parts.value("target", &from, ops);
        self.facts.note("target", source);
        if self.robot.by_name {
            self.parts.target_joints(TargetKind::Position, "target", "robot");
        } else {
            self.parts.target(TargetKind::Position, "target");
        }
        Ok(())
    }

    fn wrong_action(&self, action_len: usize, expected: usize, key: &str) -> actq::error::Error {
        Facts::contradiction(
            "length of the action",
            (&self.action_len_from, &format!("{action_len} values")),
            (&self.yaml.location(key), &format!("{expected} joints")),
        )
    }

    /// Adds the reference of the upper body relative to the default, and 0 for the lower body.
    fn residual(&mut self) -> Result<()> {
        let (n, upper) = (self.robot.len(), self.robot.upper.clone());
        ensure!(
            !upper.is_empty(),
            "{}: residual_upper_body_action is True, but dof_names_upper_body is missing or empty",
            self.yaml.file
        );
        let added: bool = self.facts.value("residual")?.unwrap_or(true);
        let source = self.facts.source("residual");
        ensure!(added, "residual = false: set residual_upper_body_action in {} to False", self.yaml.file);
        self.parts.raw("ref_upper_dof_pos", upper.len(), "rad");
        let default = upper.iter().map(|place| self.robot.default[*place]).collect();
        self.parts.value("upper_residual", "ref_upper_dof_pos", vec![Op::Subtract(Operand::List(default))]);
        add_zero(&mut self.parts, "upper_residual");
        let places = (0..n).map(|i| upper.iter().position(|place| *place == i).unwrap_or(upper.len())).collect();
        self.parts.value("residual", "upper_residual_and_zero", vec![Op::Select(Order::Places(places))]);
        for name in ["upper_residual", "upper_residual_and_zero", "residual"] {
            self.facts.note(name, source.clone());
        }
        Ok(())
    }

    /// Makes values for all joints of an action that has fewer; returns their name.
    fn short(&mut self, action_len: usize, scaled: Op) -> Result<String> {
        let n = self.robot.len();
        self.parts.value("scaled", "clipped", vec![scaled]);
        match self.facts.value::<String>("target.short")?.as_deref() {
            Some(fill @ ("zeros_first" | "zeros_last")) => {
                add_zero(&mut self.parts, "scaled");
                let moved = if fill == "zeros_first" { n - action_len..n } else { 0..action_len };
                self.parts.value("all", "scaled_and_zero", vec![padded(n, moved)]);
                Ok("all".to_owned())
            }
            _ => {
                let upper = self.robot.upper.len();
                if action_len + upper != n {
                    let key = if self.yaml.peek("dof_names_upper_body").is_some() {
                        "dof_names_upper_body"
                    } else {
                        "NUM_UPPER_BODY_JOINTS"
                    };
                    return Err(self.wrong_action(action_len, n - upper, key));
                }
                self.parts.raw("ref_upper_dof_pos", upper, "rad");
                self.parts.values("all", &["scaled", "ref_upper_dof_pos"]);
                Ok("all".to_owned())
            }
        }
    }

    pub(super) fn gains(&mut self) -> Result<()> {
        let (yaml, n) = (self.yaml, self.robot.len());
        let list = |key: &str| yaml.optional(key, "a list of finite numbers", Node::numbers);
        if let (Some(stiffness), Some(damping)) = (list("MOTOR_KP")?, list("MOTOR_KD")?) {
            for (key, list) in [("MOTOR_KP", &stiffness), ("MOTOR_KD", &damping)] {
                ensure!(
                    list.len() == n,
                    "{} has {} values; {n} are needed, one for each joint",
                    yaml.location(key),
                    list.len()
                );
            }
            let joints = self.robot.by_name.then(|| "robot".to_owned());
            self.parts.gains(Gains { joints, stiffness, damping });
            self.facts.note("gains", yaml.location("MOTOR_KP"));
        }
        Ok(())
    }
}
