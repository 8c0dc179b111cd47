//! The direction of gravity.

use actq::error::{Result, bail};

use super::parts::Parts;
use crate::description::{Op, Orientation};
use crate::facts::Facts;

/// Returns the raw input that gives the direction of gravity by a rule, its length, and the operations on it. `open`
/// stands for the rule while it is a question, and `quaternion` is the family's name of an orientation.
pub(crate) fn given_gravity<'a>(
    facts: &mut Facts,
    rule: &str,
    open: &str,
    quaternion: &'a str,
) -> Result<(&'a str, usize, Vec<Op>)> {
    let given: Option<String> = facts.value(rule)?;
    Ok(match given.as_deref().unwrap_or(open) {
        "vector" => ("projected_gravity", 3, Vec::new()),
        "wxyz" => (quaternion, 4, vec![Op::Gravity(Orientation::Wxyz)]),
        "xyzw" => (quaternion, 4, vec![Op::Gravity(Orientation::Xyzw)]),
        "rpy" => ("rpy", 3, vec![Op::Gravity(Orientation::Rpy)]),
        other => bail!("{rule} = {other:?}: give \"vector\", \"wxyz\", \"xyzw\" or \"rpy\""),
    })
}

/// Begins the term projected_gravity, by a rule.
pub(crate) fn gravity(parts: &mut Parts, rule: &str, facts: &mut Facts) -> Result<Vec<Op>> {
    let (name, len, ops) = given_gravity(facts, rule, "vector", "orientation")?;
    parts.input_as("projected_gravity", name, len, "");
    Ok(ops)
}
