//! `observation_layout`: the terms of the observation, which the metadata have from release 0.0.3 on.

use actq::error::{Error, Result, bail, ensure};
use actq::text::printable;

use crate::document::Document;
use crate::families::common::count;
use crate::yaml::Node;

/// Key of the layout.
pub(super) const LAYOUT: &str = "observation_layout";
/// Key of the limit of the whole observation's absolute values.
pub(super) const CLIP: &str = "observation_clip";
/// Module of the functions that are known.
const MODULE: &str = "holosoma.managers.observation.terms.";
/// Most terms, most values of one, and most frames.
const MOST: usize = 10_000;

/// A term.
pub(super) struct Entry {
    pub(super) group: String,
    pub(super) name: String,
    /// Module and name of its function.
    pub(super) func: String,
    /// Values in a frame.
    pub(super) dim: usize,
    pub(super) frames: usize,
    /// One factor, or one for each value.
    pub(super) scale: Vec<f64>,
    /// Limits after the scale.
    pub(super) clip: Option<[f64; 2]>,
    pub(super) has_params: bool,
    /// Its file and key.
    pub(super) at: String,
}

impl Entry {
    /// Returns the name of a function of holosoma.
    pub(super) fn function(&self) -> Option<&str> {
        self.func.strip_prefix(MODULE)?.split_once(':').map(|(_, name)| name)
    }
}

/// Reads the layout, if the metadata have one.
pub(super) fn entries(metadata: &Document) -> Result<Option<Vec<Entry>>> {
    if metadata.peek(LAYOUT).is_none_or(Node::is_null) {
        return Ok(None);
    }
    let items = metadata.keys(LAYOUT);
    ensure!(
        (1..=MOST).contains(&items.len()),
        "{}: it must be a list of 1 to {MOST} terms, as JSON",
        metadata.location(LAYOUT)
    );
    items.into_iter().map(|item| entry(metadata, &format!("{LAYOUT}.{item}"))).collect::<Result<_>>().map(Some)
}

fn entry(metadata: &Document, path: &str) -> Result<Entry> {
    let at = metadata.location(path);
    let get = |key: &str| metadata.node(&format!("{path}.{key}"));
    let text = |key: &str| {
        let text = get(key).and_then(Node::text).filter(|text| !text.is_empty() && printable(text) == **text);
        text.map(str::to_owned).ok_or_else(|| Error::input(format!("{at}.{key} must be a name")))
    };
    let whole = |key: &str| {
        let number = get(key).and_then(count).filter(|number| (1..=MOST).contains(number));
        number.ok_or_else(|| Error::input(format!("{at}.{key} must be a number from 1 to {MOST}")))
    };
    let dim = whole("dim")?;
    let scale = get("scale").and_then(Node::one_or_several);
    let Some(scale) = scale.filter(|scale| scale.len() == 1 || scale.len() == dim) else {
        bail!("{at}.scale must be one finite number, or {dim}");
    };
    let clip = match get("clip") {
        None => None,
        Some(node) => match node.pair().filter(|[low, high]| low <= high) {
            Some(pair) => Some(pair),
            None => bail!("{at}.clip must be two numbers, the lowest first, or null"),
        },
    };
    Ok(Entry {
        group: text("group")?,
        name: text("name")?,
        func: text("func")?,
        dim,
        frames: whole("history_length")?,
        scale,
        clip,
        has_params: get("params").is_some_and(|node| !node.entries().is_empty()),
        at,
    })
}
