//! Policy folders and recordings, and the content of folders.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::{Path, PathBuf};

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

/// Returns the content of everything in a folder: a file's bytes, a link's target, nothing of a folder.
pub(crate) fn snapshot(folder: &Path) -> Result<BTreeMap<PathBuf, Option<Vec<u8>>>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder)? {
            let (path, kind) = entry.and_then(|entry| Ok((entry.path(), entry.file_type()?)))?;
            let content = if kind.is_dir() {
                folders.push(path.clone());
                None
            } else if kind.is_symlink() {
                Some(fs::read_link(&path)?.into_os_string().into_encoded_bytes())
            } else {
                Some(fs::read(&path)?)
            };
            found.insert(path, content);
        }
    }
    Ok(found)
}
