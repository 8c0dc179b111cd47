//! The policy formats that the command reads. To add one, append it to `IMPORTERS`.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use actq::data::{Dataset, Learned, Recording, Sizes, described_by};
use actq::import::{Importer, PolicyFolder};
use actq::policy::Policy;
use actq_deploy::description::Description;
use actq_deploy::{DESCRIPTION, DeployFolder, observed};
use actq_kernels::image::checksum;
use actq_onnx::Onnx;
use anyhow::{Context as _, Result, ensure};

/// All importers. The first that accepts a path reads it; [`PolicyFolder`] reports a path that none accepts.
static IMPORTERS: [&dyn Importer; 3] = [&Onnx, &DeployFolder, &PolicyFolder];

fn importer(path: &Path) -> &'static dyn Importer {
    IMPORTERS.into_iter().find(|importer| importer.accepts(path)).unwrap_or(&PolicyFolder)
}

/// Reads a policy in any of the formats.
pub fn load(path: &Path) -> Result<Policy> {
    Ok(importer(path).load(path)?)
}

/// Lists all files that a policy may be read from. They need not exist.
pub(crate) fn source_files(path: &Path) -> Vec<PathBuf> {
    importer(path).files(path)
}

/// Lists the [`source_files`] of a policy with its recordings.
pub(crate) fn policy_files(path: &Path) -> Vec<PathBuf> {
    let own = source_files(path);
    own.into_iter().chain(Recording::Calib.paths(path)).chain(Recording::Heldout.paths(path)).collect()
}

/// Reads what a policy learns from: `files`, or without any the recording in its folder. With a description, `files`
/// are recordings of raw values, as images of the folder receive them, and the folder's recording holds what the
/// networks read.
pub fn learned(policy: &Policy, files: &[PathBuf]) -> Result<Option<Learned>> {
    if files.is_empty() {
        check_description(policy)?;
        return Ok(Learned::load(policy, files)?);
    }
    let mut parts = files.iter().map(|file| recorded(policy, file)).collect::<actq::error::Result<Vec<_>>>()?;
    Ok(Some(Learned::join(&mut parts, &policy.graph)?))
}

/// Refuses a recording in the folder of a bundle that was made of raw values by another description.
fn check_description(policy: &Policy) -> Result<()> {
    if policy.around.is_none() {
        return Ok(());
    }
    let own = description_checksum(&fs::read_to_string(policy.dir.join(DESCRIPTION))?)?;
    for path in Recording::Calib.paths(&policy.dir).into_iter().filter(|path| path.exists()) {
        ensure!(
            described_by(&path)?.is_none_or(|made| made == own),
            "{}: was made by another {DESCRIPTION} than the present one; pass recordings of raw values by --calib FILE, or remove it",
            path.display()
        );
    }
    Ok(())
}

/// Returns the checksum of what a description says, without its comments.
pub(crate) fn description_checksum(text: &str) -> Result<u32> {
    let description = Description::parse(text).context(DESCRIPTION)?;
    Ok(checksum(description.to_toml(&BTreeMap::default())?.as_bytes()))
}

/// Reads a recording that a user made for a policy, as what its networks read.
pub(crate) fn recorded(policy: &Policy, file: &Path) -> actq::error::Result<Dataset> {
    let recording = Dataset::load(file, recorded_sizes(policy))?;
    if policy.around.is_some() { observed(&policy.dir, &recording) } else { Ok(recording) }
}

/// Returns the sizes of recordings that a user makes for a policy: those of raw values, if it has a description.
pub fn recorded_sizes(policy: &Policy) -> Sizes {
    match &policy.around {
        Some(around) => Sizes { obs: around.raw_len(), noise: 0, out: around.action_len(), state: 0 },
        None => Sizes::of(policy),
    }
}

/// Joins recordings of [`recorded_sizes`] to what the policy's networks learn from.
pub fn learned_from(policy: &Policy, mut parts: Vec<Dataset>) -> Result<Learned> {
    if policy.around.is_some() {
        parts = parts.iter().map(|raw| observed(&policy.dir, raw)).collect::<actq::error::Result<_>>()?;
    }
    Ok(Learned::join(&mut parts, &policy.graph)?)
}
