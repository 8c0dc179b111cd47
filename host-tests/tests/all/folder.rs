//! Policy folders and recordings.

use std::fs::{self, File};
use std::path::Path;

use actq::data::NpzWriter;
use actq_testkit::{Dtype, f32_tensors, safetensors};
use anyhow::Result;
use ndarray::{Array, Dimension};
use serde_json::Value;

/// Type, shape and bytes of a tensor.
pub(crate) type Tensor = (Dtype, Vec<usize>, Vec<u8>);

/// Writes policy.json, and policy.safetensors with tensors of f32: name, shape and values.
pub(crate) fn write_policy<N: AsRef<str>>(
    folder: &Path,
    json: &Value,
    tensors: impl IntoIterator<Item = (N, Vec<usize>, Vec<f32>)>,
) -> Result<()> {
    fs::write(folder.join("policy.json"), json.to_string())?;
    Ok(fs::write(folder.join("policy.safetensors"), f32_tensors(tensors))?)
}

/// Writes policy.safetensors with named tensors.
pub(crate) fn write_tensors<N: AsRef<str>>(
    folder: &Path,
    tensors: impl IntoIterator<Item = (N, Tensor)>,
) -> Result<()> {
    let tensors = tensors.into_iter().map(|(name, (dtype, shape, bytes))| (name, dtype, shape, bytes));
    Ok(fs::write(folder.join("policy.safetensors"), safetensors(tensors))?)
}

/// Writes a recording of observations only.
pub(crate) fn write_observations<D: Dimension>(path: &Path, observations: &Array<f32, D>) -> Result<()> {
    let mut npz = NpzWriter::new(File::create(path)?);
    npz.array("obs", observations.shape(), observations.iter().copied())?;
    npz.finish()?;
    Ok(())
}
