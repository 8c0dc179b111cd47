//! The interface of an importer.

use std::path::{Path, PathBuf};

use crate::error::Result;
use crate::policy::Policy;

/// An importer of policies of one format.
pub trait Importer: Sync {
    /// Returns `true` if `path` names a policy of this format, whether or not it exists.
    fn accepts(&self, path: &Path) -> bool;

    /// Returns the files that [`Self::load`] reads.
    fn files(&self, path: &Path) -> Vec<PathBuf>;

    /// Reads the policy.
    ///
    /// # Errors
    ///
    /// If a file is missing, damaged or not supported. Every error names the file, and the op, node or tensor.
    fn load(&self, path: &Path) -> Result<Policy>;
}

/// Returns the folder of a policy's recordings: its own, or that of its file.
pub fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if path.is_file() && parent.as_os_str().is_empty() => Path::new("."),
        Some(parent) if path.is_file() => parent,
        _ => path,
    }
}
