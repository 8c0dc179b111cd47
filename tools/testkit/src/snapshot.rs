//! What a folder holds, to be compared with what it holds later.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::{fs, io};

/// Returns the content of everything in a folder: a file's bytes, a link's target, nothing of a folder.
///
/// # Errors
///
/// Errors of the folder.
pub fn snapshot(folder: &Path) -> io::Result<BTreeMap<PathBuf, Option<Vec<u8>>>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder)? {
            let (path, kind) = entry.and_then(|entry| Ok((entry.path(), entry.file_type()?)))?;
            let content = if kind.is_dir() {
                folders.push(path.clone());
                None
            } else if kind.is_symlink() {
                Some(fs::read_link(&path)?.into_os_string().into_encoded_bytes())
            } else {
                Some(fs::read(&path)?)
            };
            found.insert(path, content);
        }
    }
    Ok(found)
}
