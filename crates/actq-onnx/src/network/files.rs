//! The two files of a policy folder.

use std::collections::BTreeMap;

use actq::error::{Context as _, Result};
use actq::import::json::PolicyJson;
use safetensors::Dtype;
use safetensors::tensor::TensorView;

use crate::lower::Lowered;

/// Formats policy.json with one op per line.
pub(super) fn text(
    json: PolicyJson,
    lowered: &Lowered,
    inputs: &[(String, usize)],
    states: &[(String, String, usize)],
    source: &str,
) -> Result<Vec<u8>> {
    let mut text = serde_json::to_string_pretty(&json)?;
    let about = |key: &str, value: String| format!("  \"{key}\": {value},\n");
    let mut extra = about("source", serde_json::to_string(source)?);
    extra += &about("inputs", serde_json::to_string(inputs)?);
    if !states.is_empty() {
        extra += &about("states", serde_json::to_string(states)?);
    }
    let ops: Vec<String> =
        lowered.ops.iter().map(|op| Ok(format!("    {}", serde_json::to_string(op)?))).collect::<Result<_>>()?;
    let end = text.rfind("  \"ops\": []").context("policy.json has ops")?;
    text.truncate(end);
    Ok(format!("{text}{extra}  \"ops\": [\n{}\n  ]\n}}\n", ops.join(",\n")).into_bytes())
}

pub(super) fn tensors(lowered: &Lowered) -> Result<Vec<u8>> {
    let bytes: Vec<Vec<u8>> =
        lowered.weights.iter().map(|w| w.data.iter().flat_map(|v| v.to_le_bytes()).collect()).collect();
    let views =
        lowered.weights.iter().zip(&bytes).map(|(weight, bytes)| {
            Ok((weight.name.as_str(), TensorView::new(Dtype::F32, weight.shape.clone(), bytes)?))
        });
    let views: BTreeMap<&str, TensorView<'_>> = views.collect::<Result<_>>()?;
    Ok(safetensors::serialize(views, None)?)
}
