//! The recordings of a policy.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use super::arrays::ENDINGS;
use super::dataset::Dataset;
use super::sizes::Sizes;
use crate::error::{Context, Result, bail, ensure};
use crate::graph::Graph;
use crate::import::folder_of;
use crate::policy::Policy;

/// The two recordings that a policy's folder may hold. Only this type knows the files' names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Recording {
    /// The recording that the quantizer learns from.
    Calib,
    /// The recording that errors are measured on and nothing learns from.
    Heldout,
}

impl Recording {
    const fn stem(self) -> &'static str {
        match self {
            Self::Calib => "calib",
            Self::Heldout => "heldout",
        }
    }

    fn names(self) -> [String; 3] {
        ENDINGS.map(|ending| format!("{}.{ending}", self.stem()))
    }

    /// Returns its possible paths in a policy's folder, or beside its ONNX file.
    pub fn paths(self, policy_dir: &Path) -> [PathBuf; 3] {
        self.names().map(|name| folder_of(policy_dir).join(name))
    }

    /// Finds the recording in a policy's folder; `None` if it has none. More than one is an error, since the choice
    /// would be a guess.
    pub fn find(self, policy_dir: &Path) -> Result<Option<PathBuf>> {
        let policy_dir = folder_of(policy_dir);
        let mut there: Vec<String> = self.names().into_iter().filter(|n| policy_dir.join(n).exists()).collect();
        if there.len() > 1 {
            bail!("{}: {} are present; remove all but one", policy_dir.display(), there.join(" and "));
        }
        Ok(there.pop().map(|name| policy_dir.join(name)))
    }

    /// Reads `file`, or without it the one in the policy's folder; `None` if it has none.
    pub fn load(self, policy_dir: Option<&Path>, file: Option<&Path>, sizes: Sizes) -> Result<Option<Dataset>> {
        let path = match (file, policy_dir) {
            (Some(file), _) => Some(file.to_owned()),
            (None, Some(dir)) => self.find(dir)?,
            (None, None) => None,
        };
        path.map(|path| Dataset::load(&path, sizes)).transpose()
    }

    /// As [`Self::load`], but fails without a recording; `who` needs it.
    pub fn require(self, policy_dir: Option<&Path>, file: Option<&Path>, sizes: Sizes, who: &str) -> Result<Dataset> {
        self.load(policy_dir, file, sizes)?.with_context(|| self.missing(who))
    }

    /// Returns the message that `who` lacks the recording.
    pub fn missing(self, who: &str) -> String {
        let stem = self.stem();
        let [npz, npy, safetensors] = self.names();
        format!(
            "{who} needs recorded observations: put {npz}, {npy} or {safetensors} beside policy.json, or name a file with \
             --{stem}"
        )
    }
}

/// Returns the recordings that are `named`: files, and every .npz, .npy and .safetensors in named folders, by name. A
/// file that is named twice is refused.
pub fn files_of(named: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for path in named {
        if !path.is_dir() {
            files.push(path.clone());
            continue;
        }
        let read = || fs::read_dir(path)?.map(|entry| Ok(entry?.path())).collect::<Result<Vec<PathBuf>>>();
        let mut found = read().with_context(|| format!("{}: cannot read the folder", path.display()))?;
        let is_recording = |ending: &str| ENDINGS.contains(&ending);
        found.retain(|f| f.is_file() && f.extension().and_then(|e| e.to_str()).is_some_and(is_recording));
        ensure!(!found.is_empty(), "{}: the folder holds no recording (.npz, .npy or .safetensors)", path.display());
        found.sort();
        files.append(&mut found);
    }
    let mut known = BTreeSet::new();
    for file in &files {
        let is_new = known.insert(fs::canonicalize(file).unwrap_or_else(|_| file.clone()));
        ensure!(is_new, "{}: the recording is named twice and would count twice; name it once", file.display());
    }
    Ok(files)
}

/// The two recordings of a policy, if present.
#[derive(Clone, Debug, Default)]
pub struct Recordings {
    /// See [`Recording::Calib`].
    pub calib: Option<Dataset>,
    /// See [`Recording::Heldout`].
    pub heldout: Option<Dataset>,
}

impl Recordings {
    /// Reads those in a policy's folder.
    pub fn load(policy: &Policy) -> Result<Self> {
        let read = |recording: Recording| recording.load(Some(&policy.dir), None, Sizes::of(policy));
        Ok(Self { calib: read(Recording::Calib)?, heldout: read(Recording::Heldout)? })
    }

    /// Fills in the actions of the f32 network if a recording has none.
    pub fn fill_actions(&mut self, graph: &Graph) {
        [&mut self.calib, &mut self.heldout].into_iter().flatten().for_each(|dataset| dataset.fill_actions(graph));
    }
}
