//! Numbers of values, joints or frames.

use crate::yaml::Node;

/// Reads a number of values, joints or frames.
pub(super) fn count(node: &Node) -> Option<usize> {
    whole(node).filter(|number| *number > 0)
}

pub(super) fn whole(node: &Node) -> Option<usize> {
    let number = node.number()?;
    (number >= 0.0 && number.fract() == 0.0 && number < 1e4).then_some(number as usize)
}
