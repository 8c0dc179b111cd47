//! A policy of a spec, with its files and recordings.

use std::path::{Path, PathBuf};

use actq::data::{Dataset, Recording, Sizes, files_of};
use actq::error::{Context as _, Result};
use actq::policy::Policy;

use crate::host::Host;
use crate::job::{Input, Role};
use crate::spec::Spec;

/// A policy with its files.
pub(crate) struct Source {
    pub(crate) policy: Policy,
    pub(crate) path: PathBuf,
    files: Vec<Input>,
    /// The recordings to learn from, and their bytes.
    pub(crate) calib: Vec<Input>,
    pub(crate) calib_bytes: u64,
    pub(crate) heldout: Input,
    /// Observations of each episode of the held-out recording.
    pub(crate) lengths: Vec<usize>,
}

impl Source {
    /// Reads a policy of the spec.
    ///
    /// # Errors
    ///
    /// If a file is missing or damaged.
    pub(crate) fn read(path: &Path, spec: &Spec, host: &dyn Host) -> Result<Self> {
        let policy = host.load(path)?;
        let files: Vec<PathBuf> = host.files(path).into_iter().filter(|file| file.is_file()).collect();
        let files = files.into_iter().map(|file| Input::of(Role::Policy, file)).collect::<Result<_>>()?;
        let named = files_of(&spec.calib)?.into_iter().map(|file| (Role::Recorded, file));
        let own = Recording::Calib.find(path)?.filter(|_| spec.calib.is_empty());
        let calib = named.chain(own.map(|file| (Role::Calib, file)));
        let calib: Vec<Input> = calib.map(|(role, file)| Input::of(role, file)).collect::<Result<_>>()?;
        let bytes = |input: &Input| std::fs::metadata(&input.path).map_or(0, |file| file.len());
        let calib_bytes = calib.iter().map(bytes).sum();
        let found = || Recording::Heldout.find(path)?.with_context(|| Recording::Heldout.missing("actq sweep"));
        let heldout = spec.heldout.clone().map_or_else(found, Ok)?;
        let lengths = Dataset::load(&heldout, Sizes::of(&policy))?.length;
        let heldout = Input::of(Role::Heldout, heldout)?;
        Ok(Self { policy, path: path.to_owned(), files, calib, calib_bytes, heldout, lengths })
    }

    /// Returns the policy's files with recordings.
    pub(crate) fn with<'a>(&'a self, recordings: impl IntoIterator<Item = &'a Input>) -> Vec<Input> {
        self.files.iter().chain(recordings).cloned().collect()
    }
}
