//! Temporary files and folders, listed while they exist, so that a process that is ended by a signal can remove them.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fs::{self, File};
use std::io;
#[cfg(unix)]
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};

use tempfile::{Builder, NamedTempFile, PersistError, TempDir};

/// Characters of an output's name in that of its temporary file, whose name must not be longer than a folder takes.
const NAME_CHARS: usize = 48;

type Remove = fn(&Path) -> io::Result<()>;

/// All temporary files and folders of this process, and what removes them.
static LISTED: Mutex<BTreeMap<PathBuf, Remove>> = Mutex::new(BTreeMap::new());
/// Read by who makes temporary files and moves them to their places; written by who removes them all.
static USED: RwLock<()> = RwLock::new(());

fn listed() -> MutexGuard<'static, BTreeMap<PathBuf, Remove>> {
    LISTED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Keeps [`Discard::begin`] waiting while the value lives; after it, keeps the caller waiting for the end of the process.
pub fn hold() -> RwLockReadGuard<'static, ()> {
    USED.read().unwrap_or_else(PoisonError::into_inner)
}

/// The right to remove all temporary files and folders of a process that ends at once: while it lives no file is made,
/// and none takes its place.
#[derive(Debug)]
pub struct Discard {
    _held: RwLockWriteGuard<'static, ()>,
}

impl Discard {
    /// Waits for what is just being made or moved.
    pub fn begin() -> Self {
        Self { _held: USED.write().unwrap_or_else(PoisonError::into_inner) }
    }

    /// Removes them. Returns `true` if there was any.
    pub fn remove(&self) -> bool {
        let listed = listed();
        // In reverse order the files in a folder come before it. Nobody is left to hear of an error.
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
    /// An empty file in `folder`, to become the one of this name.
    pub(super) fn new(folder: &Path, name: &OsStr) -> io::Result<Self> {
        let name: String = name.to_string_lossy().chars().take(NAME_CHARS).collect();
        let prefix = format!(".{name}.");
        let mut builder = Builder::new();
        builder.prefix(&prefix).suffix(".part");
        // A temporary file is private to its owner; an output is as readable as the one before it, or as any new file.
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

    /// Replaces the file at `place`; the caller holds [`hold`].
    pub(super) fn persist(self, place: &Path) -> io::Result<()> {
        Ok(self.file.persist(place).map(drop)?)
    }

    /// Becomes the file at `place`; gives itself back where one is there.
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
    /// A new folder.
    pub fn new() -> io::Result<Self> {
        let _held = hold();
        let folder = TempDir::with_prefix("actq-")?;
        let listed = Listed::new(folder.path(), |path| fs::remove_dir_all(path));
        Ok(Self { folder, _listed: listed })
    }

    /// Its path.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }
}

/// A folder for outputs: if this value made it and nothing is in it in the end, it is removed.
#[derive(Debug)]
pub struct OutputFolder(Vec<(PathBuf, Listed)>);

impl OutputFolder {
    /// Makes the folder, and those that it is in, unless they are there.
    pub fn new(path: &Path) -> io::Result<Self> {
        let missing = path.ancestors().take_while(|folder| !folder.as_os_str().is_empty() && !folder.exists());
        let missing: Vec<PathBuf> = missing.map(Path::to_owned).collect();
        let _held = hold();
        let mut made = Self(Vec::new());
        for folder in missing.into_iter().rev() {
            fs::create_dir(&folder)?;
            let listed = Listed::new(&folder, |path| fs::remove_dir(path));
            made.0.push((folder, listed));
        }
        Ok(made)
    }
}

impl Drop for OutputFolder {
    fn drop(&mut self) {
        // One that holds something stays.
        self.0.iter().rev().for_each(|(folder, _)| drop(fs::remove_dir(folder)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn made_folders_go_unless_they_hold_something() {
        let dir = TempDir::new().expect("a folder");
        let (there, inner) = (dir.path().join("there"), dir.path().join("there/a/b"));
        fs::create_dir(&there).expect("a folder");
        drop(OutputFolder::new(&inner).expect("made"));
        assert!(there.exists() && !there.join("a").exists(), "the one that was there stays");
        let folder = OutputFolder::new(&inner).expect("made");
        Part::new(&inner, "x".as_ref()).expect("a file").persist(&inner.join("x")).expect("moved");
        drop(folder);
        assert!(inner.join("x").exists());
    }

    #[test]
    fn what_is_used_up_is_listed_no_more() {
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
