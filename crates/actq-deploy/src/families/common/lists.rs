//! Counts, names, and lists of them.

use actq::error::{Context as _, Result, ensure};
use actq::text::printable;

use crate::document::Document;
use crate::yaml::Node;

/// Reads a number of values or frames.
pub(crate) fn count(node: &Node) -> Option<usize> {
    let number = node.number()?;
    (number >= 0.0 && number.fract() == 0.0 && number < 1e5).then_some(number as usize)
}

/// Reads a list of numbers of values or frames.
pub(crate) fn counts(node: &Node) -> Option<Vec<usize>> {
    node.numbers()?;
    node.items().iter().map(count).collect()
}

/// Refuses names that are empty, occur twice, or have characters that a report cannot show.
pub(crate) fn check_names(names: &[String], at: &str) -> Result<()> {
    for (i, name) in names.iter().enumerate() {
        let shown = printable(name);
        ensure!(!name.is_empty() && shown == *name, "{at}: {shown:?} is not a name");
        ensure!(!names[..i].contains(name), "{at}: {name:?} occurs twice");
    }
    Ok(())
}

/// Reads a list with commas between its names.
pub(crate) fn names(meta: &Document, key: &str) -> Result<Vec<String>> {
    let text = meta.required(key, "names with commas between them", Node::text)?;
    let names: Vec<String> = text.split(',').map(|name| name.trim().to_owned()).collect();
    for (i, name) in names.iter().enumerate() {
        ensure!(!name.is_empty(), "{}: name {i} is empty", meta.location(key));
        ensure!(!names[..i].contains(name), "{}: {:?} occurs twice", meta.location(key), printable(name));
    }
    Ok(names)
}

/// Reads a list with commas between its numbers.
pub(crate) fn numbers(meta: &Document, key: &str) -> Result<Option<Vec<f64>>> {
    let Some(text) = meta.optional(key, "a text", Node::text)? else { return Ok(None) };
    let number = |word: &str| {
        let number: Option<f64> = word.trim().parse().ok().filter(|number: &f64| number.is_finite());
        number.with_context(|| format!("{}: {:?} is not a finite number", meta.location(key), printable(word.trim())))
    };
    text.split(',').map(number).collect::<Result<_>>().map(Some)
}
