//! The signature of a file: inputs, outputs and metadata of its graph.

use std::collections::BTreeMap;

use crate::file::model::{Model, Port};

/// Inputs, outputs and metadata of an ONNX file.
#[derive(Clone, Debug)]
pub struct Signature {
    /// The graph's inputs in order, with their number of values if it is known.
    pub inputs: Vec<(String, Option<usize>)>,
    /// Its outputs, likewise.
    pub outputs: Vec<(String, Option<usize>)>,
    /// Texts that the exporter stored (`metadata_props`), by key.
    pub metadata: BTreeMap<String, String>,
}

impl Signature {
    pub(crate) fn of(model: &Model) -> Self {
        let given = |port: &&Port| !model.graph.initializers.contains_key(&port.name);
        Self {
            inputs: model.graph.inputs.iter().filter(given).map(named).collect(),
            outputs: model.graph.outputs.iter().map(named).collect(),
            metadata: model.metadata.clone(),
        }
    }
}

/// Returns a port's name and number of values, where dynamic axes have the length 1.
fn named(port: &Port) -> (String, Option<usize>) {
    let len =
        port.shape.as_ref().and_then(|axes| axes.iter().map(|axis| axis.unwrap_or(1)).try_fold(1, usize::checked_mul));
    (port.name.clone(), len)
}
