//! The actions of tract itself.

use actq_onnx::{Imported, proto};
use anyhow::{Context as _, Result};
use prost::Message as _;
use prost::bytes::Bytes;
use tract_onnx::prelude::*;

/// Computes the actions with tract, step by step, with every state carried on. Inputs have the file's shapes, in the
/// file's order.
pub(super) fn computed(bytes: &[u8], imported: &Imported, observations: &[Vec<f32>]) -> Result<Vec<Vec<f32>>> {
    let mut model = tract_onnx::onnx().model_for_read(&mut &bytes[..])?;
    let ports = ports(bytes)?;
    for (i, (_, shape)) in ports.iter().enumerate() {
        model.set_input_fact(i, f32::fact(shape).into())?;
    }
    let outputs: Vec<String> =
        [&imported.output.0].into_iter().chain(imported.states.iter().map(|(_, to, _)| to)).cloned().collect();
    model.select_outputs_by_name(&outputs)?;
    let model = model.into_optimized()?.into_runnable()?;
    let mut states: Vec<Vec<f32>> = imported.states.iter().map(|(.., len)| vec![0.0; *len]).collect();
    let mut all = Vec::new();
    for obs in observations {
        let mut inputs = TVec::new();
        for (name, shape) in &ports {
            let mut at = 0;
            let mut values = vec![0.0; shape.iter().product()];
            for (input, len) in &imported.inputs {
                if input == name {
                    values.copy_from_slice(&obs[at..at + len]);
                }
                at += len;
            }
            if let Some(i) = imported.states.iter().position(|(from, ..)| from == name) {
                values.clone_from(&states[i]);
            }
            inputs.push(Tensor::from_shape(shape, &values)?.into());
        }
        let mut results = model.run(inputs)?.into_iter().map(|value| values(&value));
        all.push(results.next().context("no action")??);
        states = results.collect::<Result<_>>()?;
    }
    Ok(all)
}

/// Returns the inputs of a file with their shapes; a dynamic axis becomes 1.
fn ports(bytes: &[u8]) -> Result<Vec<(String, Vec<usize>)>> {
    let graph = proto::Graph::decode(proto::Model::decode(bytes)?.graph.context("a graph")?)?;
    let port = |bytes: &Bytes| -> Result<(String, Vec<usize>)> {
        let port = proto::ValueInfo::decode(bytes.clone())?;
        let shape = port.r#type.and_then(|t| t.tensor_type?.shape).context("a shape")?;
        let axis = |bytes: &Bytes| Ok(proto::Dimension::decode(bytes.clone())?.dim_value.map_or(1, |n| n as usize));
        Ok((port.name.unwrap_or_default(), shape.dim.iter().map(axis).collect::<Result<_>>()?))
    };
    graph.input.iter().map(port).collect()
}

fn values(value: &TValue) -> Result<Vec<f32>> {
    Ok(value.to_plain_array_view::<f32>()?.iter().copied().collect())
}
