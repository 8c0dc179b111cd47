//! The frames of the terms' histories.

use actq::error::{Context as _, Result, ensure};
use actq::text::printable;

use super::super::common::Graph;
use super::stated::Stated;
use crate::document::Document;
use crate::facts::Facts;

/// Most values of a term and most frames of a history.
pub(super) const MOST: usize = 1 << 16;

/// Returns the frames of each term that the metadata state; they must give the graph's input. While lengths are
/// questions, one frame stands for any.
pub(super) fn stated_frames(
    meta: &Document,
    graph: &Graph,
    given: &[usize],
    terms: &[String],
    lens: &[usize],
    open: bool,
) -> Result<Vec<usize>> {
    let sum = total(given, lens);
    if open || sum == Some(graph.input_len) {
        return Ok(given.to_vec());
    }
    let each = terms.iter().zip(lens).zip(given).map(|((term, len), frames)| format!("{term} {frames} times {len}"));
    let shown = sum.map_or_else(|| "too many".to_owned(), |sum| sum.to_string());
    Err(Facts::contradiction(
        "length of the observation",
        (&Stated::length_source(meta), &format!("{shown} values: {}", each.collect::<Vec<_>>().join(", "))),
        (&format!("{}: input {:?}", graph.file, printable(&graph.input)), &format!("{} values", graph.input_len)),
    ))
}

/// Returns the number of frames of each term, by the length of the graph's input.
pub(super) fn frames(
    meta: &Document,
    graph: &Graph,
    terms: &[String],
    lens: &[usize],
    open: bool,
    facts: &mut Facts,
) -> Result<Vec<usize>> {
    let sum: usize = lens.iter().sum();
    let all = graph.input_len;
    let one = vec![1; lens.len()];
    if sum == all || (open && sum > all) {
        return Ok(one);
    }
    let key = "history.length";
    let shown = || terms.iter().zip(lens).map(|(term, len)| format!("{term} {len}")).collect::<Vec<_>>().join(", ");
    let meaning = format!(
        "the terms have {sum} values ({}), and the graph's input {:?} {all}; how many frames of each term does it take? Give a list of one number for each term, or one number for all",
        shown(),
        printable(&graph.input)
    );
    if open && !all.is_multiple_of(sum) {
        // The lengths are questions, so this is one later.
        return Ok(one);
    }
    let answer: Option<toml::Value> = facts.missing(key, &meaning)?;
    let Some(answer) = answer else {
        if all.is_multiple_of(sum) {
            return Ok(vec![all / sum; lens.len()]);
        }
        return Err(Facts::contradiction(
            &format!(
                "length of the observation (if it has histories, answer {key} with a list of one number of frames for each term)"
            ),
            (&meta.location("observation_names"), &format!("{sum} values: {}", shown())),
            (&format!("{}: input {:?}", graph.file, printable(&graph.input)), &format!("{all} values")),
        ));
    };
    let count = |value: &toml::Value| value.as_integer().and_then(|n| usize::try_from(n).ok());
    let frames = match &answer {
        toml::Value::Array(list) => list.iter().map(count).collect::<Option<Vec<_>>>(),
        one => count(one).map(|n| vec![n; lens.len()]),
    };
    let frames = frames.filter(|frames| frames.len() == lens.len() && frames.iter().all(|n| (1..=MOST).contains(n)));
    let frames = frames
        .with_context(|| format!("answer {key}: give a number of frames, or a list of {} of them", lens.len()))?;
    let given = total(&frames, lens);
    ensure!(
        given == Some(all),
        "answer {key}: it gives {} values, and the graph's input {:?} takes {all} ({})",
        given.map_or_else(|| "too many".to_owned(), |given| given.to_string()),
        printable(&graph.input),
        shown()
    );
    Ok(frames)
}

/// Returns the number of values of all frames; nothing if there are too many.
fn total(frames: &[usize], lens: &[usize]) -> Option<usize> {
    frames.iter().zip(lens).try_fold(0usize, |sum, (frames, len)| sum.checked_add(frames.checked_mul(*len)?))
}
