//! The formats of policies that the command reads. To add one, add it to [`IMPORTERS`].

use std::path::{Path, PathBuf};

use actq::data::Recording;
use actq::import::{Importer, PolicyFolder};
use actq::policy::Policy;
use actq_onnx::Onnx;
use anyhow::Result;

/// The first that accepts a path reads it; a path that none accepts is said to be no policy folder.
static IMPORTERS: [&dyn Importer; 2] = [&Onnx, &PolicyFolder];

fn importer(path: &Path) -> &'static dyn Importer {
    IMPORTERS.into_iter().find(|importer| importer.accepts(path)).unwrap_or(&PolicyFolder)
}

/// Reads a policy in any of the formats.
pub(crate) fn load(path: &Path) -> Result<Policy> {
    Ok(importer(path).load(path)?)
}

/// All files that a policy may be read from, recordings included, whether they are there or not.
pub(crate) fn policy_files(path: &Path) -> Vec<PathBuf> {
    let own = importer(path).files(path);
    own.into_iter().chain(Recording::Calib.paths(path)).chain(Recording::Heldout.paths(path)).collect()
}
