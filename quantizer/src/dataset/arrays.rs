//! The arrays of a recording, out of the files that it may come in.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::BufReader;
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use safetensors::Dtype;

use super::npy;
use super::npz::Archive;
use crate::tensor_file;

/// The names that mean something; other arrays are left alone, whatever their type.
const NAMES: [&str; 4] = ["obs", "action", "length", "state"];

/// The named arrays of a file.
pub(super) struct Arrays {
    /// All names in the file.
    names: Vec<String>,
    known: BTreeMap<&'static str, Stored>,
}

/// An array as it was stored, row-major.
pub(super) struct Stored {
    pub(super) shape: Vec<usize>,
    pub(super) values: Values,
}

pub(super) enum Values {
    F32(Vec<f32>),
    F64(Vec<f64>),
    I32(Vec<i32>),
    I64(Vec<i64>),
    /// Of a type that no array of a recording has.
    Other(String),
}

impl Arrays {
    /// The ending of the file's name says which format it has.
    pub(super) fn read(path: &Path) -> Result<Self> {
        ensure!(fs::metadata(path).context("cannot be read")?.len() > 0, "the file is empty");
        match path.extension().and_then(|e| e.to_str()) {
            Some("npz") => npz(path),
            Some("npy") => npy(path),
            Some("safetensors") => safetensors(path),
            _ => bail!("a recording's name ends in .npz, .npy or .safetensors"),
        }
    }

    pub(super) fn take(&mut self, name: &str) -> Option<Stored> {
        self.known.remove(name)
    }

    /// What the file holds, for messages.
    pub(super) fn names(&self) -> String {
        if self.names.is_empty() { "nothing".to_owned() } else { self.names.join(", ") }
    }
}

impl Stored {
    /// The values as f32; what f32 cannot hold becomes infinite.
    pub(super) fn floats(&self, name: &str) -> Result<Vec<f32>> {
        Ok(match &self.values {
            Values::F32(values) => values.clone(),
            Values::F64(values) => values.iter().map(|&v| v as f32).collect(),
            other => bail!("array {name:?} is of type {}, float32 or float64 is needed", other.type_name()),
        })
    }

    /// What is wrong with value `i`, which is not a finite f32.
    pub(super) fn not_f32(&self, i: usize) -> String {
        match &self.values {
            Values::F32(values) => format!("holds {}", values[i]),
            Values::F64(values) if values[i].is_finite() => format!("holds {:e}, beyond float32's range,", values[i]),
            Values::F64(values) => format!("holds {}", values[i]),
            _ => String::new(),
        }
    }
}

impl Values {
    pub(super) fn type_name(&self) -> &str {
        match self {
            Self::F32(_) => "float32",
            Self::F64(_) => "float64",
            Self::I32(_) => "int32",
            Self::I64(_) => "int64",
            Self::Other(name) => name,
        }
    }
}

fn npz(path: &Path) -> Result<Arrays> {
    let mut archive = Archive::open(File::open(path).context("cannot be read")?)?;
    let mut known = BTreeMap::new();
    for name in NAMES {
        let array = archive.read(name).with_context(|| format!("array {name:?} cannot be read"))?;
        known.extend(array.map(|array| (name, array)));
    }
    Ok(Arrays { names: archive.names().map(str::to_owned).collect(), known })
}

/// One array without a name: the observations.
fn npy(path: &Path) -> Result<Arrays> {
    let file = File::open(path).context("cannot be read")?;
    let bytes = file.metadata().context("cannot be read")?.len();
    let obs = npy::read(&mut BufReader::new(file), bytes).context("not an .npy array, or one that was cut off")?;
    Ok(Arrays { names: vec!["obs".to_owned()], known: BTreeMap::from([("obs", obs)]) })
}

fn safetensors(path: &Path) -> Result<Arrays> {
    let bytes = fs::read(path).context("cannot be read")?;
    let file = tensor_file::open(&bytes).context("not a .safetensors file, or one that was cut off")?;
    let mut names: Vec<String> = file.names().into_iter().map(|name| name.to_owned()).collect();
    names.sort_unstable();
    let mut known = BTreeMap::new();
    for name in NAMES {
        let Ok(view) = file.tensor(name) else { continue };
        let (words, doubles) = (view.data().as_chunks().0, view.data().as_chunks().0);
        let values = match view.dtype() {
            Dtype::F32 => Values::F32(words.iter().map(|b| f32::from_le_bytes(*b)).collect()),
            Dtype::F64 => Values::F64(doubles.iter().map(|b| f64::from_le_bytes(*b)).collect()),
            Dtype::I32 => Values::I32(words.iter().map(|b| i32::from_le_bytes(*b)).collect()),
            Dtype::I64 => Values::I64(doubles.iter().map(|b| i64::from_le_bytes(*b)).collect()),
            other => Values::Other(format!("{other:?}")),
        };
        known.insert(name, Stored { shape: view.shape().to_vec(), values });
    }
    Ok(Arrays { names, known })
}
