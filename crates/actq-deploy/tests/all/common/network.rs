//! Networks and tensors that fixtures write as TOML.

use std::collections::BTreeMap;

use actq::error::{Error, Result};
use actq_testkit::{Dtype, safetensors};
use serde::Deserialize;

use super::onnx;

/// Operator, inputs, outputs and attributes.
type Node = (String, Vec<String>, Vec<String>, BTreeMap<String, usize>);

/// A network: lengths of the input and the output of a linear one, or a graph.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Network {
    linear: Option<[usize; 2]>,
    #[serde(default)]
    inputs: Vec<(String, Vec<usize>)>,
    #[serde(default)]
    outputs: Vec<(String, Vec<usize>)>,
    #[serde(default)]
    nodes: Vec<Node>,
    #[serde(default)]
    tensors: Vec<(String, Vec<usize>, Values)>,
    #[serde(default)]
    metadata: toml::Table,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Values {
    Each(Vec<f32>),
    All {
        all: f32,
    },
    /// Those of [`onnx::weights`], times a factor.
    Weights {
        weights: f32,
    },
}

/// Makes an ONNX file.
pub(crate) fn network(text: &str) -> Result<Vec<u8>> {
    let network: Network = toml::from_str(text).map_err(Error::other)?;
    let metadata: Vec<(&str, &str)> =
        network.metadata.iter().map(|(key, value)| (key.as_str(), value.as_str().unwrap_or_default())).collect();
    if let Some([inputs, outputs]) = network.linear {
        return Ok(onnx::linear(inputs, outputs, &metadata));
    }
    let parts = network.nodes.iter().map(|(operator, reads, gives, attributes)| {
        let attributes: Vec<(&str, usize)> = attributes.iter().map(|(name, value)| (name.as_str(), *value)).collect();
        (operator.as_str(), names(reads), names(gives), attributes)
    });
    let parts: Vec<_> = parts.collect();
    let nodes: Vec<onnx::Node<'_>> = parts
        .iter()
        .map(|(operator, reads, gives, attributes)| (*operator, &reads[..], &gives[..], &attributes[..]))
        .collect();
    let tensors = network.tensors.iter().map(|(name, shape, values)| {
        let len = shape.iter().product();
        let values = match values {
            Values::Each(values) => values.clone(),
            Values::All { all } => vec![*all; len],
            Values::Weights { weights } => onnx::weights(1, len).into_iter().map(|weight| weights * weight).collect(),
        };
        (name.as_str(), &shape[..], values)
    });
    let tensors: Vec<_> = tensors.collect();
    let inputs: Vec<_> = network.inputs.iter().map(|(name, shape)| (name.as_str(), &shape[..])).collect();
    let outputs: Vec<_> = network.outputs.iter().map(|(name, shape)| (name.as_str(), &shape[..])).collect();
    Ok(onnx::shaped(&nodes, &tensors, &inputs, &outputs, &metadata))
}

fn names(names: &[String]) -> Vec<&str> {
    names.iter().map(String::as_str).collect()
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Tensor {
    shape: Vec<usize>,
    /// Values in f32; zeros of two bytes without them.
    values: Option<Vec<f32>>,
    dtype: Option<String>,
}

/// Makes a .safetensors file.
pub(crate) fn tensors(text: &str) -> Result<Vec<u8>> {
    let tensors: BTreeMap<String, Tensor> = toml::from_str(text).map_err(Error::other)?;
    Ok(safetensors(tensors.into_iter().map(|(name, tensor)| {
        let zeros = vec![0; 2 * tensor.shape.iter().product::<usize>()];
        let bytes = |values: Vec<f32>| values.iter().flat_map(|value| value.to_le_bytes()).collect();
        let dtype = if tensor.dtype.is_some() { Dtype::F16 } else { Dtype::F32 };
        (name, dtype, tensor.shape, tensor.values.map_or(zeros, bytes))
    })))
}
