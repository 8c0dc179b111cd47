//! The target, and the gains of its joints.

use actq::error::Result;

use super::super::common::Parts;
use super::robot::Robot;
use super::ros::Ros;
use crate::description::{Gains, Op, Operand, Order, TargetKind};
use crate::facts::Facts;

/// Adds the target: the scaled action, added to its base.
pub(super) fn target(parts: &mut Parts, robot: &Robot, ros: Option<&Ros<'_>>, facts: &mut Facts) -> Result<()> {
    let mut ops = vec![Op::Scale(Operand::Name("action_scale".to_owned()))];
    let base: Option<String> = facts.value("target.base")?;
    match base.as_deref() {
        Some("current") => {
            let position = if ros.is_some() { "position" } else { "joint_pos" };
            let mut select = robot.select();
            select.extend(robot.moved_places().map(|places| Op::Select(Order::Places(places))));
            parts.value("current", position, select);
            ops.push(Op::Add(Operand::Name("current".to_owned())));
        }
        Some("nothing") => {}
        _ => {
            parts.rounded_constant("target_default", robot.of_moved(&robot.default), parts.rounding("default"));
            ops.push(Op::Add(Operand::Name("target_default".to_owned())));
        }
    }
    parts.value("processed", "policy.ACTION", ops);
    let mut ops = Vec::new();
    if let Some(signs) = &robot.signs {
        ops.push(Op::Scale(Operand::List(robot.of_moved(signs))));
    }
    if robot.sent != robot.moved {
        let place = |joint: &String| robot.moved.iter().position(|other| other == joint);
        ops.push(Op::Select(Order::Places(robot.sent.iter().filter_map(place).collect())));
    }
    parts.value("target", "processed", ops);
    facts.note("target", format!("{}; {}", robot.scale_source, facts.source("target.base")));
    parts.target_joints(TargetKind::Position, "target", robot.sent_order());
    if let Some([stiffness, damping]) = robot.gains.clone() {
        parts.gains(Gains { joints: Some(robot.moved_order().to_owned()), stiffness, damping });
        facts.note("gains", robot.gains_source.clone());
    }
    Ok(())
}
