//! Inputs and outputs of the graph, and the use of the outputs.

use actq::error::{Context as _, Result, bail, ensure};
use actq::text::printable;
use actq_onnx::Signature;
use serde::Deserialize;

use super::super::common::{known, listed};
use crate::document::Document;
use crate::facts::Facts;

/// Names of the input with the history.
pub(super) const BUFFERS: [&str; 2] = ["buffer", "hist_obs"];

/// Returns a name of TorchScript without its number: `t` of `t.1`.
pub(super) fn base(name: &str) -> &str {
    match name.rsplit_once('.') {
        Some((base, number)) if !base.is_empty() && number.bytes().all(|b| b.is_ascii_digit()) => base,
        _ => name,
    }
}

/// Inputs and outputs of the graph with their lengths.
pub(super) struct Graph {
    pub(super) file: String,
    pub(super) inputs: Vec<(String, usize)>,
    pub(super) outputs: Vec<(String, usize)>,
}

impl Graph {
    pub(super) fn of(file: &str, signature: Signature) -> Result<Self> {
        let (inputs, outputs) = (known(file, &signature.inputs)?, known(file, &signature.outputs)?);
        let graph = Self { file: file.to_owned(), inputs, outputs };
        for (i, (name, _)) in graph.inputs.iter().enumerate() {
            ensure!(
                graph.inputs[..i].iter().all(|(other, _)| base(other) != base(name)),
                "{file}: several inputs are called {:?}",
                printable(base(name))
            );
        }
        Ok(graph)
    }

    /// Compares the inputs with those that the metadata names.
    pub(super) fn check_names(&self, meta: &Document) -> Result<()> {
        let named = meta.keys("input_params");
        let here: Vec<&str> = self.inputs.iter().map(|(name, _)| base(name)).collect();
        if named.is_empty() || (named.len() == here.len() && named.iter().all(|name| here.contains(name))) {
            return Ok(());
        }
        Err(Facts::contradiction(
            "inputs",
            (&meta.location("input_params"), &named.join(", ")),
            (&self.file, &here.join(", ")),
        ))
    }

    pub(super) fn has_input(&self, name: &str) -> bool {
        self.inputs.iter().any(|(input, _)| base(input) == name)
    }

    /// Returns the length of an output.
    pub(super) fn output(&self, name: &str) -> Result<usize> {
        let output = self.outputs.iter().find(|(output, _)| output == name);
        let named = || format!("{}: it has no output {:?}; it has {}", self.file, printable(name), self.listed());
        output.map(|(_, len)| *len).with_context(named)
    }

    fn listed(&self) -> String {
        listed(&self.outputs)
    }
}

/// Outputs by their use.
pub(super) struct Outputs {
    pub(super) action: String,
    pub(super) scaled: String,
    /// The buffer of the next tick, if the graph has one.
    pub(super) buffer: Option<String>,
}

impl Outputs {
    pub(super) fn of(graph: &Graph, facts: &mut Facts) -> Result<Self> {
        let action = Self::choose(graph, "states.prev_actions", facts)?;
        let scaled = Self::choose(graph, "target.output", facts)?;
        let buffer = graph.inputs.iter().find(|(name, _)| BUFFERS.contains(&base(name)));
        let Some((input, len)) = buffer else { return Ok(Self { action, scaled, buffer: None }) };
        let key = "states.buffer";
        let by_length = |(name, other): &&(String, usize)| other == len && *name != action && *name != scaled;
        let candidates: Vec<&str> = graph.outputs.iter().filter(by_length).map(|(name, _)| name.as_str()).collect();
        let buffer = match (facts.value::<String>(key)?.as_deref(), &candidates[..]) {
            (Some("by length"), [only]) => Some((*only).to_owned()),
            (Some("by length"), []) => bail!(
                "{}: the input {:?} has {len} values, and no other output has that length ({}); its next value is lost",
                graph.file,
                printable(input),
                graph.listed()
            ),
            (Some("by length"), several) => {
                let meaning = format!(
                    "several outputs have the length {len} of the input {:?} ({}); which of them is its next value?",
                    printable(input),
                    several.join(", ")
                );
                let answer = facts.missing::<String>(key, &meaning)?;
                ensure!(answer.is_none(), "{key}: {meaning}");
                Some(several[0].to_owned())
            }
            (Some(name), _) => {
                let given = graph.output(name)?;
                ensure!(
                    given == *len,
                    "{key} = {name:?} has {given} values, and the input {:?} of {} takes {len}",
                    printable(input),
                    graph.file
                );
                Some(name.to_owned())
            }
            // A question; any output stands for the answer.
            (None, candidates) => Some(candidates.first().map_or_else(|| action.clone(), |name| (*name).to_owned())),
        };
        Ok(Self { action, scaled, buffer })
    }

    /// Returns the output that a rule names, or asks for it.
    fn choose(graph: &Graph, key: &str, facts: &mut Facts) -> Result<String> {
        let has = |name: &&String| graph.outputs.iter().any(|(output, _)| output == *name);
        let first = graph.outputs.first().with_context(|| format!("{}: it has no outputs", graph.file))?;
        match facts.value::<Choice>(key)? {
            None => Ok(first.0.clone()),
            Some(Choice::One(name)) => graph.output(&name).map(|_| name),
            Some(Choice::First(names)) => {
                if let Some(name) = names.iter().find(has) {
                    return Ok(name.clone());
                }
                let meaning =
                    format!("the graph has no output {}; which one is it: {}?", names.join(" or "), graph.listed());
                facts.missing::<String>(key, &meaning)?;
                Ok(first.0.clone())
            }
        }
    }
}

/// A name, or several in order of preference.
#[derive(Deserialize)]
#[serde(untagged)]
enum Choice {
    One(String),
    First(Vec<String>),
}
