//! The history of the observation.

use actq::error::{Result, ensure};

use super::super::common::{Histories, counts};
use super::config::Config;
use crate::description::First;
use crate::facts::Facts;

/// Returns the number of frames, and how they are kept.
pub(super) fn frames(config: &Config<'_>, facts: &mut Facts) -> Result<(usize, Histories)> {
    let key = "observations_history";
    let numbers = config.optional(key, "a list of frames' numbers, from 0", counts)?.unwrap_or_default();
    let by_term =
        config.optional("observations_history_priority", "\"time\" or \"term\"", |node| match node.text()? {
            "time" => Some(false),
            "term" => Some(true),
            _ => None,
        })?;
    facts.note("observation", config.location("observations"));
    if matches!(numbers[..], [] | [0]) {
        let (first, fill) = Default::default();
        return Ok((1, Histories { by_term: false, first, fill, stride: 1 }));
    }
    let ascends = numbers[0] == 0;
    let ascending: Vec<usize> = if ascends { numbers.clone() } else { numbers.iter().rev().copied().collect() };
    let stride = ascending.get(1).copied().unwrap_or(0);
    let is_even = ascending.iter().enumerate().all(|(i, number)| stride.checked_mul(i) == Some(*number));
    ensure!(
        stride > 0 && is_even,
        "{}: only numbers in equal steps, from 0 or down to 0, are supported",
        config.location(key)
    );
    let has_priority = by_term.is_some();
    let (by_term, layout) = match by_term {
        Some(by_term) => (by_term, config.location("observations_history_priority")),
        None => (facts.is_choice("history.layout", "term")?, facts.source("history.layout")),
    };
    // Releases without the priority go through the list from its end or from its beginning, and the file does not say
    // which one it is of.
    let is_stated = ascends || has_priority;
    let zero_is_oldest = match is_stated {
        true => facts.is_choice("history.zero", "oldest")?,
        false => facts.is_answered("history.zero", "oldest")?,
    };
    let first = if ascends == zero_is_oldest { First::Oldest } else { First::Newest };
    let fill = facts.value_or_default("history.fill")?;
    let [zero, filled] = ["history.zero", "history.fill"].map(|rule| facts.source(rule));
    facts.note("observation", format!("{}; {layout}; {zero}; {filled}", config.location(key)));
    Ok((numbers.len(), Histories { by_term, first, fill, stride }))
}
