//! Archives in a bundle, unpacked to a temporary folder: gzipped tar files, as kinfer writes them.

use std::fs::File;
use std::io::{Read as _, Write as _};
use std::path::{Path, PathBuf};

use actq::error::{Context as _, Result, ensure};
use flate2::read::GzDecoder;
use tempfile::TempDir;

/// Most bytes of all files of an archive, unpacked.
const MAX_BYTES: u64 = 256 << 20;
/// Most files of an archive.
const MAX_FILES: usize = 100;
/// First bytes of a gzipped file.
const MAGIC: [u8; 2] = [0x1f, 0x8b];

/// An archive's files.
#[derive(Debug)]
pub(crate) struct Archive {
    folder: TempDir,
    /// Names of its files, which are in no folders.
    pub(crate) names: Vec<String>,
}

impl Archive {
    /// Unpacks a file; nothing if it is not gzipped.
    ///
    /// # Errors
    ///
    /// If it is damaged, has too many files or bytes, or a file in a folder.
    pub(crate) fn open(path: &Path) -> Result<Option<Self>> {
        let mut first = Vec::new();
        File::open(path)?.take(2).read_to_end(&mut first)?;
        if first != MAGIC {
            return Ok(None);
        }
        let unpacked = GzDecoder::new(File::open(path)?).take(MAX_BYTES);
        let (mut archive, folder) = (tar::Archive::new(unpacked), TempDir::new()?);
        let (mut names, mut bytes) = (Vec::new(), 0u64);
        let damaged = "it is gzipped, and no tar archive, or damaged";
        for entry in archive.entries().context(damaged)? {
            let mut entry = entry.context(damaged)?;
            let name = entry.path().context(damaged)?.to_string_lossy().into_owned();
            let is_plain = !name.is_empty() && !name.starts_with('.') && !name.contains(['/', '\\', ':']);
            ensure!(is_plain && entry.header().entry_type().is_file(), "its entry {name:?} is not a file by itself");
            ensure!(
                !names.contains(&name) && names.len() < MAX_FILES,
                "{name:?} occurs twice, or it has over {MAX_FILES} files"
            );
            bytes = entry.size().saturating_add(bytes);
            ensure!(bytes <= MAX_BYTES, "it has over {MAX_BYTES} bytes, unpacked");
            let mut content = Vec::new();
            entry.read_to_end(&mut content).context(damaged)?;
            File::create(folder.path().join(&name))?.write_all(&content)?;
            names.push(name);
        }
        Ok(Some(Self { folder, names }))
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }
}
