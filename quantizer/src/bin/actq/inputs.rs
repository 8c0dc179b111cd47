//! The files that a command reads.

use std::path::{Path, PathBuf};

use actq::data::Recording;
use actq::import::{FILES, is_onnx};

/// All files that a policy's folder may hold, whether they are there or not.
pub(crate) fn policy_files(dir: &Path) -> Vec<PathBuf> {
    let own = if is_onnx(dir) { vec![dir.to_owned()] } else { FILES.map(|name| dir.join(name)).to_vec() };
    own.into_iter().chain(Recording::Calib.paths(dir)).chain(Recording::Heldout.paths(dir)).collect()
}
