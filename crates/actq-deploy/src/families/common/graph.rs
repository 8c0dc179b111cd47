//! The graph's input and output, and its metadata.

use std::collections::BTreeMap;

use actq::error::{Context as _, Result};
use actq::text::printable;
use actq_onnx::Signature;

use crate::document::Document;
use crate::yaml::{Data, Node};

/// The graph's input and output.
#[derive(Debug)]
pub(crate) struct Graph {
    pub(crate) file: String,
    pub(crate) input: String,
    pub(crate) input_len: usize,
    pub(crate) output: String,
    pub(crate) actions: usize,
}

impl Graph {
    pub(crate) fn of(file: &str, signature: &Signature) -> Result<Self> {
        let choose = |ports: &[(String, Option<usize>)], kind: &str, usual: &str| -> Result<(String, usize)> {
            let port = match ports {
                [only] => Some(only),
                _ => ports.iter().find(|(name, _)| name == usual),
            };
            let shown = || ports.iter().map(|(name, _)| printable(name)).collect::<Vec<_>>().join(", ");
            let (name, len) = port.with_context(|| format!("{file}: none of its {kind} is {usual:?}: {}", shown()))?;
            Ok((name.clone(), known_len(file, name, *len)?))
        };
        let (input, input_len) = choose(&signature.inputs, "inputs", "obs")?;
        let (output, actions) = choose(&signature.outputs, "outputs", "actions")?;
        Ok(Self { file: file.to_owned(), input, input_len, output, actions })
    }
}

/// Returns inputs or outputs with their lengths, which the file must give.
pub(crate) fn known(file: &str, ports: &[(String, Option<usize>)]) -> Result<Vec<(String, usize)>> {
    ports.iter().map(|(name, len)| Ok((name.clone(), known_len(file, name, *len)?))).collect()
}

fn known_len(file: &str, name: &str, len: Option<usize>) -> Result<usize> {
    let len = len.filter(|len| *len > 0);
    len.with_context(|| format!("{file}: the length of {:?} is not given", printable(name)))
}

/// Lists inputs or outputs with their lengths, for a message.
pub(crate) fn listed(ports: &[(String, usize)]) -> String {
    ports.iter().map(|(name, len)| format!("{} [{len}]", printable(name))).collect::<Vec<_>>().join(", ")
}

/// Takes an ONNX file's metadata as a document of texts.
pub(crate) fn metadata_document(file: &str, metadata: &BTreeMap<String, String>) -> Document {
    let entry =
        |(key, text): (&String, &String)| (key.clone(), Node { line: 1, data: Data::Scalar(text.clone(), true) });
    let data = Data::Map(metadata.iter().map(entry).collect());
    Document::of(&format!("{file} metadata"), Node { line: 1, data })
}

/// The input of the observation and the output of the action, with their lengths if known.
#[derive(Debug)]
pub(crate) struct Ports {
    pub(crate) input: String,
    pub(crate) output: String,
    pub(crate) observation_len: Option<usize>,
    pub(crate) action_len: Option<usize>,
}
