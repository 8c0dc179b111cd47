//! What the tests and `xtask` share: golden kernel cases, drawn networks, the command `actq`, and the firmware under QEMU.
#![forbid(unsafe_code)]

pub mod command;
pub mod cycles;
pub mod evaluation;
pub mod golden;
pub mod networks;
pub mod profile;
pub mod qemu;

use std::path::{Path, PathBuf};

/// The workspace's root.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap_or(Path::new("."))
}

/// The folder of shared policies, where `ACTQ_SHARED` names it: tests on them run only then.
pub fn shared_policies() -> Option<PathBuf> {
    let folder = std::env::var_os("ACTQ_SHARED").filter(|folder| !folder.is_empty())?;
    Some(PathBuf::from(folder).join("policies"))
}
