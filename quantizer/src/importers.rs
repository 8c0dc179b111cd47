//! The policy formats that the command reads. To add one, append it to [`IMPORTERS`].

use std::path::{Path, PathBuf};

use actq::data::{Dataset, Learned, Recording, Sizes};
use actq::import::{Importer, PolicyFolder};
use actq::policy::Policy;
use actq_deploy::{DeployFolder, observed};
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

/// Reads what a policy learns from: `files`, or without any the recording in its folder. With a description, `files`
/// are recordings of raw values, as images of the folder receive them, and the folder's recording holds what the
/// networks read.
pub(crate) fn learned(path: &Path, policy: &Policy, files: &[PathBuf]) -> Result<Option<Learned>> {
    let Some(around) = policy.around.as_ref().filter(|_| !files.is_empty()) else {
        return Ok(Learned::load(policy, files)?);
    };
    let sizes = Sizes { obs: around.raw_len(), noise: 0, out: around.action_len(), state: 0 };
    let read = |file: &PathBuf| observed(path, &Dataset::load(file, sizes)?);
    let mut parts = files.iter().map(read).collect::<actq::error::Result<Vec<_>>>()?;
    Ok(Some(Learned::join(&mut parts, &policy.graph)?))
}
