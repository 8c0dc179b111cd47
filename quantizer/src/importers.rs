//! The policy formats that the command reads. To add one, append it to [`IMPORTERS`].

use std::path::{Path, PathBuf};

use actq::data::Recording;
use actq::import::{Importer, PolicyFolder};
use actq::policy::Policy;
use actq_deploy::DeployFolder;
use actq_onnx::Onnx;
use anyhow::Result;

/// All importers. The first that accepts a path reads it; [`PolicyFolder`] reports a path that none accepts.
static IMPORTERS: [&dyn Importer; 3] = [&Onnx, &DeployFolder, &PolicyFolder];

fn importer(path: &Path) -> &'static dyn Importer {
    IMPORTERS.into_iter().find(|importer| importer.accepts(path)).unwrap_or(&PolicyFolder)
}

/// Reads a policy in any of the formats.
pub(crate) fn load(path: &Path) -> Result<Policy> {
    Ok(importer(path).load(path)?)
}

/// Lists all files that a policy may be read from, with its recordings. They need not exist.
pub(crate) fn policy_files(path: &Path) -> Vec<PathBuf> {
    let own = importer(path).files(path);
    own.into_iter().chain(Recording::Calib.paths(path)).chain(Recording::Heldout.paths(path)).collect()
}
