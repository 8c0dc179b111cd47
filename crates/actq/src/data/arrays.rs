//! Reads the arrays of a recording from any supported file format.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::BufReader;
use std::path::Path;

use super::npy;
use super::npz::Archive;
use crate::error::{Context, Result, bail, ensure};
use crate::import::tensors::TensorFile;
use crate::import::values::{Tensor, Values};

/// Names with a meaning; other arrays are ignored, whatever their type.
const NAMES: [&str; 5] = ["obs", "action", "length", "state", "noise"];

/// File name extensions of recordings.
pub(super) const ENDINGS: [&str; 3] = ["npz", "npy", "safetensors"];

pub(super) struct Arrays {
    /// All names in the file.
    names: Vec<String>,
    known: BTreeMap<&'static str, Tensor>,
}

impl Arrays {
    /// Reads a file in the format of its extension.
    pub(super) fn read(path: &Path) -> Result<Self> {
        ensure!(fs::metadata(path).context("cannot read the file")?.len() > 0, "the file is empty");
        match path.extension().and_then(|e| e.to_str()) {
            Some("npz") => npz(path),
            Some("npy") => npy(path),
            Some("safetensors") => safetensors(path),
            _ => bail!("unknown recording format; use .npz, .npy or .safetensors"),
        }
    }

    /// Takes arrays in memory.
    pub(super) fn of(mut arrays: BTreeMap<String, Tensor>) -> Self {
        let names = arrays.keys().cloned().collect();
        Self { names, known: NAMES.into_iter().filter_map(|name| Some((name, arrays.remove(name)?))).collect() }
    }

    /// Returns `true` if the file has an array of this name.
    pub(super) fn has(&self, name: &str) -> bool {
        self.names.iter().any(|of| of == name)
    }

    pub(super) fn take(&mut self, name: &str) -> Option<Tensor> {
        self.known.remove(name)
    }

    /// Returns the names of the file's arrays, for messages.
    pub(super) fn names(&self) -> String {
        if self.names.is_empty() { "nothing".to_owned() } else { self.names.join(", ") }
    }
}

/// Reads one array of a file without the others; `None` if it has none of this name.
pub(super) fn one(path: &Path, name: &str) -> Result<Option<Tensor>> {
    match path.extension().and_then(|e| e.to_str()) {
        Some("npz") => Archive::open(File::open(path).context("cannot read the file")?)?.read(name),
        Some("safetensors") => Ok(TensorFile::new(&fs::read(path).context("cannot read the file")?)?.get(name)),
        _ => Ok(None),
    }
}

/// Reads all arrays of an .npz file, or the one of an .npy file under the name of the file, whatever their names.
///
/// # Errors
///
/// If the file cannot be read, is damaged, or has another extension. The error names the file and the array.
pub fn arrays(path: &Path) -> Result<BTreeMap<String, Tensor>> {
    let open = || File::open(path).context("cannot read the file");
    let read = || match path.extension().and_then(|e| e.to_str()) {
        Some("npz") => {
            let mut archive = Archive::open(open()?)?;
            let names: Vec<String> = archive.names().map(str::to_owned).collect();
            let mut read = |name: String| {
                let array = archive.read(&name).with_context(|| format!("cannot read array {name:?}"))?;
                Ok(array.map(|array| (name, array)))
            };
            names.into_iter().filter_map(|name| read(name).transpose()).collect()
        }
        Some("npy") => {
            let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
            let file = open()?;
            let bytes = file.metadata().context("cannot read the file")?.len();
            let array = npy::read(&mut BufReader::new(file), bytes).context("not an .npy array, or a truncated one")?;
            Ok(BTreeMap::from([(stem, array)]))
        }
        _ => bail!("unknown format of arrays; use .npz or .npy"),
    };
    read().with_context(|| path.display().to_string())
}

/// Returns the values of an array as f32; values beyond f32 become infinite.
pub(super) fn floats(array: &Tensor, name: &str) -> Result<Vec<f32>> {
    let of_recordings = matches!(array.values, Values::F32(_) | Values::F64(_));
    let values = if of_recordings { array.values.to_f32() } else { None };
    let found = array.values.type_name();
    values.with_context(|| format!("array {name:?} is of type {found}; use float32 or float64"))
}

fn npz(path: &Path) -> Result<Arrays> {
    let mut archive = Archive::open(File::open(path).context("cannot read the file")?)?;
    let mut known = BTreeMap::new();
    for name in NAMES {
        let array = archive.read(name).with_context(|| format!("cannot read array {name:?}"))?;
        known.extend(array.map(|array| (name, array)));
    }
    Ok(Arrays { names: archive.names().map(str::to_owned).collect(), known })
}

/// Reads one array without a name: the observations.
fn npy(path: &Path) -> Result<Arrays> {
    let file = File::open(path).context("cannot read the file")?;
    let bytes = file.metadata().context("cannot read the file")?.len();
    let obs = npy::read(&mut BufReader::new(file), bytes).context("not an .npy array, or a truncated one")?;
    Ok(Arrays { names: vec!["obs".to_owned()], known: BTreeMap::from([("obs", obs)]) })
}

fn safetensors(path: &Path) -> Result<Arrays> {
    let bytes = fs::read(path).context("cannot read the file")?;
    let file = TensorFile::new(&bytes).context("not a .safetensors file, or a truncated one")?;
    let known = NAMES.into_iter().filter_map(|name| Some((name, file.get(name)?))).collect();
    Ok(Arrays { names: file.names(), known })
}
