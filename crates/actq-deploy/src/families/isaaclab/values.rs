//! Values that both files have.

use actq::error::{Result, ensure};

use crate::document::Document;
use crate::families::common::count;
use crate::yaml::Node;

/// Most frames of a history.
const MAX_FRAMES: usize = 1000;

/// Reads a lowest and a highest number, either of which may be infinite.
pub(super) fn bounds(node: &Node) -> Option<[f64; 2]> {
    let bound = |node: &Node| match node.text()? {
        ".inf" | "+.inf" | ".Inf" | "inf" => Some(f64::INFINITY),
        "-.inf" | "-.Inf" | "-inf" => Some(f64::NEG_INFINITY),
        _ => node.number(),
    };
    let [low, high] = node.items() else { return None };
    let (low, high) = (bound(low)?, bound(high)?);
    (low <= high).then_some([low, high])
}

/// Reads one number or several.
pub(super) fn numbers(node: &Node) -> Option<Vec<f64>> {
    node.one_or_several().filter(|numbers| !numbers.is_empty())
}

/// Reads the number of frames that a term or a group observes.
pub(super) fn history(yaml: &Document, at: &str) -> Result<usize> {
    let (length, flat) = (format!("{at}.history_length"), format!("{at}.flatten_history_dim"));
    let frames = yaml.optional(&length, "a number of frames", count)?.unwrap_or(0).max(1);
    ensure!(frames <= MAX_FRAMES, "{} = {frames}: at most {MAX_FRAMES} frames are read", yaml.location(&length));
    let is_flat = yaml.optional(&flat, "true or false", Node::truth)?.unwrap_or(true);
    ensure!(
        frames == 1 || is_flat,
        "{} = false: a history with an axis of its own is not supported",
        yaml.location(&flat)
    );
    Ok(frames)
}

/// Reads the keys of a term's delay if they say that it has none; others stay unread. Returns `true` if they are there,
/// as from release 3.0.0 on.
pub(super) fn no_delay(yaml: &Document, at: &str) -> bool {
    let most = yaml.peek(&format!("{at}.delay_max_lag"));
    if most.and_then(Node::number) == Some(0.0) {
        for key in ["delay_min_lag", "delay_max_lag", "delay_hold_prob"] {
            yaml.node(&format!("{at}.{key}"));
        }
    }
    most.is_some()
}
