//! Tensor files in the format safetensors: policies and recordings.

use std::collections::BTreeMap;

use half::{bf16, f16};
use safetensors::tensor::TensorView;
use safetensors::{Dtype, SafeTensors};

use super::values::{Tensor, Values};
use crate::error::{Context, Result, bail};
use crate::strict_json;

/// The tensors of a file.
#[derive(Debug)]
pub struct TensorFile<'a>(SafeTensors<'a>);

impl<'a> TensorFile<'a> {
    /// Reads the header, and refuses duplicate names; the crate alone would keep the last one.
    pub fn new(bytes: &'a [u8]) -> Result<Self> {
        // The header follows its length; the crate refuses a wrong length.
        let header = bytes.split_first_chunk().and_then(|(len, rest)| {
            let len = usize::try_from(u64::from_le_bytes(*len)).ok()?;
            rest.get(..len)
        });
        header.map(strict_json::parse).transpose().context("its header")?;
        Ok(Self(SafeTensors::deserialize(bytes)?))
    }

    /// Returns the tensors' names, sorted.
    pub fn names(&self) -> Vec<String> {
        let mut names: Vec<String> = self.0.names().into_iter().map(str::to_owned).collect();
        names.sort_unstable();
        names
    }

    /// Returns all tensors by their names.
    pub fn all(&self) -> BTreeMap<String, Tensor> {
        self.names().into_iter().filter_map(|name| Some((name.clone(), self.get(&name)?))).collect()
    }

    /// Returns a tensor; `None` if the file has none of that name.
    pub fn get(&self, name: &str) -> Option<Tensor> {
        let view = self.0.tensor(name).ok()?;
        let bytes = view.data();
        let values = match view.dtype() {
            Dtype::F32 => Values::F32(elements(bytes, f32::from_le_bytes)),
            Dtype::F64 => Values::F64(elements(bytes, f64::from_le_bytes)),
            Dtype::F16 => Values::F16(elements(bytes, f16::from_le_bytes)),
            Dtype::BF16 => Values::BF16(elements(bytes, bf16::from_le_bytes)),
            Dtype::I32 => Values::I32(elements(bytes, i32::from_le_bytes)),
            Dtype::I64 => Values::I64(elements(bytes, i64::from_le_bytes)),
            other => Values::Other(format!("{other:?}")),
        };
        Some(Tensor { shape: view.shape().to_vec(), values })
    }
}

fn elements<const N: usize, T>(bytes: &[u8], of: fn([u8; N]) -> T) -> Vec<T> {
    bytes.as_chunks().0.iter().map(|b| of(*b)).collect()
}

/// Returns a file of float32 tensors.
pub(super) fn written(tensors: &BTreeMap<String, Tensor>) -> Result<Vec<u8>> {
    let bytes = |(name, tensor): (&String, &Tensor)| match &tensor.values {
        Values::F32(values) => Ok(values.iter().flat_map(|v| v.to_le_bytes()).collect()),
        other => bail!("tensor {name:?} is of type {}; a policy's tensors are float32", other.type_name()),
    };
    let bytes = tensors.iter().map(bytes).collect::<Result<Vec<Vec<u8>>>>()?;
    let view = |((name, tensor), bytes): ((&'_ String, &Tensor), _)| {
        Ok((name.clone(), TensorView::new(Dtype::F32, tensor.shape.clone(), bytes)?))
    };
    let views = tensors.iter().zip(bytes.iter().map(Vec::as_slice)).map(view);
    Ok(safetensors::serialize(views.collect::<Result<BTreeMap<_, _>>>()?, None)?)
}
