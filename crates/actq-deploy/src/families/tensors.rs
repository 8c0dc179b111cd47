//! Tensors of .safetensors files.

use std::collections::BTreeMap;
use std::fs;

use actq::error::{Context as _, Result, ensure};
use actq::import::tensors::TensorFile;
use actq::import::values::{Tensor, Values};
use actq::text::printable;

use crate::bundle::Bundle;

/// Most bytes of a file: more than the weights of a network that fits a microcontroller.
const MAX_BYTES: u64 = 256 << 20;

/// Reads the tensors with some names.
pub(super) fn tensors(bundle: &Bundle, file: &str, keep: impl Fn(&str) -> bool) -> Result<BTreeMap<String, Tensor>> {
    let path = bundle.path(file)?;
    let read = || -> Result<_> {
        let bytes = fs::metadata(&path).context("cannot read the file")?.len();
        ensure!(bytes <= MAX_BYTES, "it has {bytes} bytes; at most {MAX_BYTES} are allowed");
        let bytes = fs::read(&path).context("cannot read the file")?;
        let tensors = TensorFile::new(&bytes).context("not a .safetensors file, or a truncated one")?;
        let names = tensors.names().into_iter().filter(|name| keep(name));
        Ok(names.filter_map(|name| Some((name.clone(), tensors.get(&name)?))).collect())
    };
    read().with_context(|| file.to_owned())
}

/// Returns a tensor's numbers; `at` names it in errors.
pub(super) fn finite(tensor: &Tensor, at: &str) -> Result<Vec<f64>> {
    let supported = matches!(tensor.values, Values::F32(_) | Values::F64(_) | Values::I64(_));
    let values = tensor.values.to_f64().filter(|_| supported);
    let values = values.with_context(|| {
        format!("{at} is of type {}; use float32, float64 or int64", printable(tensor.values.type_name()))
    })?;
    let wrong = values.iter().position(|value| !(*value as f32).is_finite());
    ensure!(
        wrong.is_none(),
        "{at}: value {} (from 0) is {}; give finite float32 numbers",
        wrong.unwrap_or_default(),
        wrong.map_or(0.0, |i| values[i])
    );
    Ok(values)
}
