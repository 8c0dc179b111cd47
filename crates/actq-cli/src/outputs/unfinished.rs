//! A list of temporary files and folders, for their removal when a signal ends the process.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fs::{self, File};
use std::io;
#[cfg(unix)]
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};

use anyhow::{Context as _, Result, ensure};
use tempfile::{Builder, NamedTempFile, PersistError, TempDir};

/// Characters of an output's name in the name of its temporary file, which must not become too long for the file
/// system.
const NAME_CHARS: usize = 48;

type Remove = fn(&Path) -> io::Result<()>;

/// All temporary files and folders of this process, with the functions that remove them.
static TEMPORARIES: Mutex<BTreeMap<PathBuf, Remove>> = Mutex::new(BTreeMap::new());
/// Lock for reading while temporary files are created or moved to their places, for writing while all are removed.
static FILES_LOCK: RwLock<()> = RwLock::new(());

fn listed() -> MutexGuard<'static, BTreeMap<PathBuf, Remove>> {
    TEMPORARIES.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Blocks [`Discard::begin`] while the value lives. After that, blocks the caller until the process ends.
pub fn hold() -> RwLockReadGuard<'static, ()> {
    FILES_LOCK.read().unwrap_or_else(PoisonError::into_inner)
}

/// Permission to remove all temporary files and folders at the end of the process. While it lives, no file is created
/// or moved to its place.
#[derive(Debug)]
pub struct Discard {
    _held: RwLockWriteGuard<'static, ()>,
}

impl Discard {
    /// Waits until no file is being created or moved.
    pub fn begin() -> Self {
        Self { _held: FILES_LOCK.write().unwrap_or_else(PoisonError::into_inner) }
    }

    /// Removes all temporary files and folders. Returns `true` if there were any.
    pub fn remove(&self) -> bool {
        let listed = listed();
        // In reverse order, the files in a folder come before the folder. The process ends, so errors are dropped.
        listed.iter().rev().for_each(|(path, remove)| drop(remove(path)));
        !listed.is_empty()
    }
}

/// An entry of the list.
#[derive(Debug)]
struct Listed(PathBuf);

impl Listed {
    fn new(path: &Path, remove: Remove) -> Self {
        listed().insert(path.to_owned(), remove);
        Self(path.to_owned())
    }
}

impl Drop for Listed {
    fn drop(&mut self) {
        listed().remove(&self.0);
    }
}

/// A temporary file beside its place.
#[derive(Debug)]
pub(super) struct Part {
    file: NamedTempFile,
    listed: Listed,
}

impl Part {
    /// Creates an empty file in `folder` that will become the file of this name.
    pub(super) fn new(folder: &Path, name: &OsStr) -> io::Result<Self> {
        let name: String = name.to_string_lossy().chars().take(NAME_CHARS).collect();
        let prefix = format!(".{name}.");
        let mut builder = Builder::new();
        builder.prefix(&prefix).suffix(".part");
        // By default, temporary files are private to their owner; outputs have the permissions of any new file.
        #[cfg(unix)]
        builder.permissions(fs::Permissions::from_mode(0o666));
        let _held = hold();
        let file = builder.tempfile_in(folder)?;
        let listed = Listed::new(file.path(), |path| fs::remove_file(path));
        Ok(Self { file, listed })
    }

    pub(super) fn file(&mut self) -> &mut File {
        self.file.as_file_mut()
    }

    /// Replaces the file at `place`. The caller must keep the guard of [`hold`].
    pub(super) fn persist(self, place: &Path) -> io::Result<()> {
        Ok(self.file.persist(place).map(drop)?)
    }

    /// Becomes the file at `place`. If one exists, returns itself with the error.
    pub(super) fn persist_new(self, place: &Path) -> Result<(), (io::Error, Self)> {
        let Self { file, listed } = self;
        let _held = hold();
        match file.persist_noclobber(place) {
            Ok(_) => Ok(()),
            Err(PersistError { error, file }) => Err((error, Self { file, listed })),
        }
    }
}

/// A temporary folder that is removed with everything in it.
#[derive(Debug)]
pub struct Scratch {
    folder: TempDir,
    _listed: Listed,
}

impl Scratch {
    /// Creates a folder.
    pub fn new() -> io::Result<Self> {
        let _held = hold();
        let folder = TempDir::with_prefix("actq-")?;
        let listed = Listed::new(folder.path(), |path| fs::remove_dir_all(path));
        Ok(Self { folder, _listed: listed })
    }

    /// Returns its path.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }
}

/// A folder for outputs. The drop removes it if this value created it and it is empty.
#[derive(Debug)]
pub struct OutputFolder(Vec<(PathBuf, Listed)>);

impl OutputFolder {
    /// Creates the folder and its missing parents. Refuses a path that exists and is not a folder.
    pub fn new(path: &Path) -> Result<Self> {
        let name = path.display();
        ensure!(path.is_dir() || !path.exists(), "{name}: exists and is not a folder; pass the name of a folder");
        let missing = path.ancestors().take_while(|folder| !folder.as_os_str().is_empty() && !folder.exists());
        let missing: Vec<PathBuf> = missing.map(Path::to_owned).collect();
        let _held = hold();
        let mut made = Self(Vec::new());
        for folder in missing.into_iter().rev() {
            fs::create_dir(&folder).with_context(|| format!("{name}: cannot create the folder"))?;
            let listed = Listed::new(&folder, |path| fs::remove_dir(path));
            made.0.push((folder, listed));
        }
        Ok(made)
    }
}

impl Drop for OutputFolder {
    fn drop(&mut self) {
        // A folder that is not empty stays.
        self.0.iter().rev().for_each(|(folder, _)| drop(fs::remove_dir(folder)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn empty_created_folders_are_removed() {
        let dir = TempDir::new().expect("a folder");
        let (there, inner) = (dir.path().join("there"), dir.path().join("there/a/b"));
        fs::create_dir(&there).expect("a folder");
        drop(OutputFolder::new(&inner).expect("made"));
        assert!(there.exists() && !there.join("a").exists(), "an existing folder stays");
        let folder = OutputFolder::new(&inner).expect("made");
        Part::new(&inner, "x".as_ref()).expect("a file").persist(&inner.join("x")).expect("moved");
        drop(folder);
        assert!(inner.join("x").exists());
    }

    #[test]
    fn placed_and_dropped_files_leave_the_list() {
        let dir = TempDir::new().expect("a folder");
        let part = Part::new(dir.path(), "x".as_ref()).expect("a file");
        let (path, scratch) = (part.file.path().to_owned(), Scratch::new().expect("a folder"));
        let folder = scratch.path().to_owned();
        assert!([&path, &folder].iter().all(|path| listed().contains_key(*path)));
        part.persist(&dir.path().join("x")).expect("moved");
        drop(scratch);
        assert!(![&path, &folder].iter().any(|path| listed().contains_key(*path)) && !folder.exists());
    }
}
