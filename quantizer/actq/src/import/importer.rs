//! What reads policies of one format.

use std::path::{Path, PathBuf};

use crate::error::Result;
use crate::policy::Policy;

/// Reads policies of one format.
pub trait Importer: Sync {
    /// Returns `true` if `path` names a policy of this format, whether it is there or not.
    fn accepts(&self, path: &Path) -> bool;

    /// The files that [`Self::load`] reads.
    fn files(&self, path: &Path) -> Vec<PathBuf>;

    /// Reads the policy.
    ///
    /// # Errors
    ///
    /// Where a file is missing, damaged or not supported. Every error names the file, and the op, node or tensor.
    fn load(&self, path: &Path) -> Result<Policy>;
}

/// The folder in which a policy's recordings are: its own, or the one that its file is in.
pub fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if path.is_file() && parent.as_os_str().is_empty() => Path::new("."),
        Some(parent) if path.is_file() => parent,
        _ => path,
    }
}
