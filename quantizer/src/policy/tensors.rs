//! `policy.safetensors`: its tensors as f32.

use std::path::Path;

use anyhow::{Result, bail, ensure};
use safetensors::{Dtype, SafeTensors};

use crate::graph::WeightMatrix;

/// The tensors of a file that `path` names in errors.
pub(super) struct Tensors<'a> {
    pub(super) file: &'a SafeTensors<'a>,
    pub(super) path: &'a Path,
}

impl Tensors<'_> {
    /// The tensor as f32 with its shape; refuses NaN, infinities and what f32 cannot hold.
    fn read(&self, name: &str) -> Result<(Vec<usize>, Vec<f32>)> {
        let file = self.path.display();
        let Ok(view) = self.file.tensor(name) else {
            let mut names = self.file.names();
            names.sort_unstable();
            bail!("{file}: tensor {name:?} is missing; the file holds {}", names.join(", "));
        };
        let bytes = view.data();
        let doubles = || bytes.as_chunks().0.iter().map(|b| f64::from_le_bytes(*b));
        let data: Vec<f32> = match view.dtype() {
            Dtype::F32 => bytes.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect(),
            Dtype::F16 => bytes.as_chunks().0.iter().map(|b| half::f16::from_le_bytes(*b).to_f32()).collect(),
            Dtype::BF16 => bytes.as_chunks().0.iter().map(|b| half::bf16::from_le_bytes(*b).to_f32()).collect(),
            Dtype::F64 => doubles().map(|v| v as f32).collect(),
            other => bail!("{file}: tensor {name:?} is of type {other:?}; export it as float32"),
        };
        if let Some(at) = data.iter().position(|v| !v.is_finite()) {
            let wide = if view.dtype() == Dtype::F64 { doubles().nth(at).filter(|v| v.is_finite()) } else { None };
            let value = wide.map_or(data[at].to_string(), |v| format!("{v:e}, beyond float32's range,"));
            bail!("{file}: tensor {name:?} holds {value} at position {at}; retrain or repair the checkpoint");
        }
        Ok((view.shape().to_vec(), data))
    }

    pub(super) fn vector(&self, name: &str, len: usize) -> Result<Vec<f32>> {
        let (shape, data) = self.read(name)?;
        ensure!(
            data.len() == len,
            "{}: tensor {name:?} has the shape {shape:?}, {len} values are needed here",
            self.path.display()
        );
        Ok(data)
    }

    pub(super) fn matrix(&self, name: &str, rows: Option<usize>, cols: usize) -> Result<WeightMatrix> {
        let (shape, data) = self.read(name)?;
        let fits = matches!(shape[..], [r, c] if r > 0 && c == cols && rows.is_none_or(|rows| r == rows));
        ensure!(
            fits,
            "{}: tensor {name:?} has the shape {shape:?}, [{}, {cols}] is needed here (rows are outputs)",
            self.path.display(),
            rows.map_or("out".to_owned(), |r| r.to_string()),
        );
        Ok(WeightMatrix { name: name.to_owned(), rows: shape[0], cols, data })
    }
}
