//! Facts in the files of the training: the rate, and the names of values.

use actq::error::{Result, ensure};
use actq::text::printable;

use super::feature::{Feature, join};
use crate::bundle::Bundle;
use crate::document::Document;
use crate::facts::Facts;
use crate::yaml::{Data, Node};

/// Files of the dataset and of the training. Only the keys below are read of them.
const INFO: &str = "meta/info.json";
const TRAINING: &str = "train_config.json";

/// The files, if the bundle has them.
pub(super) struct Training {
    info: Option<Document>,
    config: Option<Document>,
}

impl Training {
    pub(super) fn of(bundle: &Bundle, folder: &str, facts: &mut Facts) -> Result<Self> {
        let info = bundle.find(INFO)?.map(|file| Document::read(bundle, file)).transpose()?;
        info.as_ref().map(|info| facts.version(info)).transpose()?;
        let config = join(folder, TRAINING);
        let config = bundle.has(&config).then(|| Document::read(bundle, &config)).transpose()?;
        Ok(Self { info, config })
    }

    /// Returns the ticks a second: those of the dataset, or of the environment.
    pub(super) fn rate(&self, facts: &mut Facts) -> Result<f64> {
        let mut found = Vec::new();
        for (document, key) in [(&self.info, "fps"), (&self.config, "env.fps")] {
            let Some(document) = document else { continue };
            if let Some(rate) = document.optional(key, "a number of ticks a second", Node::number)? {
                found.push((rate, document.location(key)));
            }
        }
        let rate = match &found[..] {
            [(rate, at)] => {
                facts.note("rate_hz", at.clone());
                *rate
            }
            [(first, at), (second, _)] if first == second => {
                facts.note("rate_hz", at.clone());
                *first
            }
            [(first, at), (second, second_at), ..] => match facts.value("rate_hz")? {
                Some(rate) => rate,
                None => {
                    return Err(Facts::contradiction(
                        "rate (answer rate_hz to decide)",
                        (at, &first.to_string()),
                        (second_at, &second.to_string()),
                    ));
                }
            },
            [] => facts.value("rate_hz")?.unwrap_or(1.0),
        };
        ensure!(rate > 0.0, "{}: rate_hz = {rate}: give a number above 0", facts.source("rate_hz"));
        Ok(rate)
    }

    /// Returns the names of a feature's values and where they are, if the dataset states them.
    pub(super) fn names(&self, feature: &Feature) -> Result<Option<(Vec<String>, String)>> {
        let Some(info) = &self.info else { return Ok(None) };
        let path = format!("features.{}", feature.name);
        let shape = info.optional(&format!("{path}.shape"), "a list of lengths", Node::numbers)?;
        if let Some(shape) = shape
            && shape != [feature.len as f64]
        {
            return Err(Facts::contradiction(
                &format!("shape of {:?}", printable(&feature.name)),
                (&feature.at, &format!("[{}]", feature.len)),
                (&info.location(&path), &format!("{shape:?}")),
            ));
        }
        let path = format!("{path}.names");
        let Some(names) = info.optional(&path, "a list of texts, or a map with one", names)? else { return Ok(None) };
        let at = info.location(&path);
        // One name of several values is that of the axis.
        if names.len() == 1 && feature.len > 1 {
            return Ok(None);
        }
        if names.len() != feature.len {
            return Err(Facts::contradiction(
                &format!("number of values of {:?}", printable(&feature.name)),
                (&feature.at, &format!("{} values", feature.len)),
                (&at, &format!("{} names", names.len())),
            ));
        }
        for (i, name) in names.iter().enumerate() {
            ensure!(!names[..i].contains(name), "{at}: {:?} occurs twice", printable(name));
        }
        Ok(Some((names, at)))
    }
}

/// Reads names: a list, or the only list of a map, as older datasets have.
fn names(node: &Node) -> Option<Vec<String>> {
    match &node.data {
        Data::Map(entries) => match &entries[..] {
            [(_, names)] => names.texts(),
            _ => None,
        },
        _ => node.texts(),
    }
}
