//! Limits, places and the memory of an action.

use std::ops::Range;

use actq::error::Result;

use super::parts::{ACTION, Parts};
use crate::description::{Op, Operand, Order};
use crate::facts::Facts;

/// Makes an operation that limits absolute values.
pub(crate) fn clip_to(limit: f64) -> Op {
    Op::Clip([Operand::Number(-limit), Operand::Number(limit)])
}

/// Adds the value clipped: the action within the limit of the rule action.clip.
pub(crate) fn clip(parts: &mut Parts, facts: &mut Facts) -> Result<()> {
    let limit: f64 = facts.value("action.clip")?.unwrap_or(100.0);
    parts.value("clipped", ACTION, vec![clip_to(limit)]);
    facts.note("clipped", facts.source("action.clip"));
    Ok(())
}

/// Adds the state last_action, which is the action or the value clipped, by the rule last_action.
pub(crate) fn fed_back(parts: &mut Parts, len: usize, facts: &mut Facts) -> Result<()> {
    let next = if facts.is_choice("last_action", "raw")? { ACTION } else { "clipped" };
    parts.state("last_action", len, next);
    facts.note("last_action", facts.source("last_action"));
    Ok(())
}

/// Adds the value `NAME_and_zero`, which has one 0 after a value, for places that nothing moves.
pub(crate) fn add_zero(parts: &mut Parts, name: &str) {
    parts.constant_value("zero", vec![0.0]);
    parts.values(&format!("{name}_and_zero"), &[name, "zero"]);
}

/// Makes an operation that puts the values of `NAME_and_zero` at the places `moved` of `n`, and 0 at the others.
pub(crate) fn padded(n: usize, moved: Range<usize>) -> Op {
    let place = |i| if moved.contains(&i) { i - moved.start } else { moved.len() };
    Op::Select(Order::Places((0..n).map(place).collect()))
}
