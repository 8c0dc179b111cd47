//! Writing files: each whole or not at all, all or none, and never over what the command reads.

use std::ffi::OsStr;
use std::fs::{self, File, Metadata, OpenOptions, Permissions};
use std::io::{ErrorKind, Write as _};
#[cfg(unix)]
use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};

use super::unfinished::{Part, hold};

/// Links from one to the next that are followed; as many as Linux follows.
const MOST_LINKS: usize = 40;
/// Numbers that are tried behind a name that is taken.
const MOST_NUMBERS: usize = 9999;

/// Writes `bytes` to `path` so that neither a failure nor an end of the process leaves part of a file there. (A process
/// that is killed while it writes can leave a hidden file of this name with the ending .part.)
///
/// A symbolic link stays, and what it points to is written. A file that is replaced keeps its permissions; one that is
/// read-only is refused. A device or pipe is written to as it is.
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    reserve(&[path], &[])?.write(&[bytes])
}

/// As [`write()`], with the content that `fill` puts into the file.
pub fn write_with(path: &Path, fill: impl FnOnce(&mut File) -> Result<()>) -> Result<()> {
    Output::place_all([Output::new(path)?.fill(fill)?])
}

/// Writes a new file, as [`write_with`] does, and gives its name: `path`, or, where something is there already, `path`
/// with the first number from 2 on behind its stem that is free. Nothing is ever replaced, whoever else is looking for
/// a name.
pub fn write_new(path: &Path, fill: impl FnOnce(&mut File) -> Result<()>) -> Result<PathBuf> {
    let create = || -> Result<PathBuf> {
        let (folder, name) = folder_and_name(path)?;
        let mut part = Part::new(folder, name)?;
        fill(part.file())?;
        part.file().sync_all()?;
        for number in 1..=MOST_NUMBERS {
            let place = numbered(path, number);
            match part.persist_new(&place) {
                Ok(()) => return Ok(place),
                Err((error, rest)) if error.kind() == ErrorKind::AlreadyExists => part = rest,
                Err((error, _)) => return Err(error.into()),
            }
        }
        bail!("all names up to {} are taken", numbered(path, MOST_NUMBERS).display())
    };
    create().with_context(|| named(path))
}

/// Refuses, before any work is done, a name for [`write_new`] in whose folder no file can be made.
pub fn check_new(path: &Path) -> Result<()> {
    let check = || -> Result<()> {
        let (folder, name) = folder_and_name(path)?;
        // No name is too long for a temporary file.
        path.try_exists()?;
        Ok(Part::new(folder, name).map(drop)?)
    };
    check().with_context(|| named(path))
}

/// `path` itself as number 1, then `stem-2.ending`, `stem-3.ending` and so on.
fn numbered(path: &Path, number: usize) -> PathBuf {
    if number == 1 {
        return path.to_owned();
    }
    let mut name = path.file_stem().unwrap_or_default().to_owned();
    name.push(format!("-{number}"));
    if let Some(ending) = path.extension() {
        name.push(".");
        name.push(ending);
    }
    path.with_file_name(name)
}

/// Where a file's temporary neighbour can be.
fn folder_and_name(path: &Path) -> Result<(&Path, &OsStr)> {
    let name = path.file_name().context("it names no file")?;
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    ensure!(folder.is_dir(), "there is no folder {}", folder.display());
    Ok((folder, name))
}

/// Outputs of a command, each with an empty file beside its place: what keeps a file from being written is known before
/// any work is done. Nothing is left of them if they are not written.
#[derive(Debug)]
pub struct Outputs(Vec<Output>);

/// Reserves outputs. Refuses those that are one of the command's `inputs` or each other, under whatever names, and those
/// that cannot be written. An input that does not exist counts as well: a file of its name would be read the next time.
pub fn reserve(outputs: &[&Path], inputs: &[PathBuf]) -> Result<Outputs> {
    let inputs: Vec<(Identity, &PathBuf)> = inputs.iter().filter_map(|path| Some((identity(path)?, path))).collect();
    let mut before: Vec<(Identity, &Path)> = Vec::new();
    for &output in outputs {
        place(output).with_context(|| named(output))?;
        let Some(own) = identity(output) else { continue };
        let name = output.display();
        if let Some((_, input)) = inputs.iter().find(|(input, _)| *input == own) {
            bail!("{name}: is the same file as {}, which the command reads; name another output", input.display());
        }
        if let Some((_, other)) = before.iter().find(|(other, _)| *other == own) {
            bail!("{name}: is the same file as {}; every output needs its own", other.display());
        }
        before.push((own, output));
    }
    outputs.iter().map(|path| Output::new(path)).collect::<Result<_>>().map(Outputs)
}

impl Outputs {
    /// Writes all files, one content for each output in their order, or none if one of them cannot be written. What a
    /// device or pipe was given is given.
    pub fn write(self, contents: &[impl AsRef<[u8]>]) -> Result<()> {
        debug_assert_eq!(self.0.len(), contents.len());
        // Everything that is likely to fail is done before the first file takes its place.
        let filled = self
            .0
            .into_iter()
            .zip(contents)
            .map(|(output, bytes)| output.fill(|file| Ok(file.write_all(bytes.as_ref())?)));
        Output::place_all(filled.collect::<Result<Vec<_>>>()?)
    }

    /// Returns `true` if one of the outputs is the device or pipe of this name.
    pub fn include_stream(&self, stream: &Path) -> bool {
        let stream = identity(stream);
        self.0.iter().any(|output| matches!(output.target, Target::Stream(_)) && identity(&output.name) == stream)
    }
}

fn named(path: &Path) -> String {
    format!("{}: cannot be written", path.display())
}

/// What makes two names one file.
#[derive(PartialEq)]
enum Identity {
    /// Device and inode.
    #[cfg(unix)]
    Inode(u64, u64),
    /// Where no file is yet, and where files have no numbers.
    Place(PathBuf),
}

fn identity(path: &Path) -> Option<Identity> {
    #[cfg(unix)]
    if let Ok(file) = fs::metadata(path) {
        return Some(Identity::Inode(file.dev(), file.ino()));
    }
    fs::canonicalize(path).or_else(|_| follow(path)).ok().map(Identity::Place)
}

/// The path that is meant, its folder resolved and its links followed; a file need not exist there. A link to an open
/// file, as `/dev/stdout` is one in the end, is not followed.
fn follow(path: &Path) -> Result<PathBuf> {
    let mut path = path.to_owned();
    for _ in 0..MOST_LINKS {
        let name = path.file_name().context("it names no file")?;
        let parent = match path.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        let parent = fs::canonicalize(parent).with_context(|| format!("the folder {}", parent.display()))?;
        let place = parent.join(name);
        match fs::read_link(&place) {
            Ok(target) if !holds_open_files(&parent) => path = parent.join(target),
            _ => return Ok(place),
        }
    }
    bail!("more than {MOST_LINKS} links follow each other");
}

/// Whether a folder's entries stand for files that a process has opened.
fn holds_open_files(folder: &Path) -> bool {
    folder.starts_with("/proc") || folder == Path::new("/dev/fd")
}

/// What an output becomes.
enum Place {
    /// A file, and the permissions of the one that it replaces.
    File(PathBuf, Option<Permissions>),
    /// A device or a pipe.
    Stream(PathBuf),
}

fn place(path: &Path) -> Result<Place> {
    ensure!(!path.is_dir(), "it is a folder");
    let place = follow(path)?;
    match fs::metadata(&place) {
        Ok(old) if old.is_file() => {
            let open = place.parent().is_some_and(holds_open_files);
            ensure!(!open, "it stands for a file that is open already; name the file itself");
            ensure!(!old.permissions().readonly(), "it is read-only");
            Ok(Place::File(place, Some(kept(&old))))
        }
        Ok(_) => Ok(Place::Stream(place)),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(Place::File(place, None)),
        Err(error) => Err(error.into()),
    }
}

/// An output that can be written.
#[derive(Debug)]
struct Output {
    name: PathBuf,
    target: Target,
}

#[derive(Debug)]
enum Target {
    /// A file, the one beside its place that becomes it, and the permissions that it gets.
    File(Part, PathBuf, Option<Permissions>),
    /// A device or a pipe. It is opened when there is something to write: to open a pipe waits for its reader.
    Stream(PathBuf),
}

impl Output {
    fn new(name: &Path) -> Result<Self> {
        let target = || -> Result<Target> {
            let (place, permissions) = match place(name)? {
                Place::File(place, permissions) => (place, permissions),
                Place::Stream(place) => return Ok(Target::Stream(place)),
            };
            let (folder, file) = folder_and_name(&place)?;
            Ok(Target::File(Part::new(folder, file)?, place, permissions))
        };
        Ok(Self { name: name.to_owned(), target: target().with_context(|| named(name))? })
    }

    /// Writes the content; a file has yet to take its place.
    fn fill(mut self, fill: impl FnOnce(&mut File) -> Result<()>) -> Result<Self> {
        let write = || match &mut self.target {
            Target::Stream(place) => fill(&mut OpenOptions::new().write(true).open(place)?),
            Target::File(part, _, permissions) => {
                fill(part.file())?;
                if let Some(permissions) = permissions.take() {
                    part.file().set_permissions(permissions)?;
                }
                Ok(part.file().sync_all()?)
            }
        };
        write().with_context(|| named(&self.name))?;
        Ok(self)
    }

    /// Moves filled files to their places; a signal ends the process before the first or after the last.
    fn place_all(filled: impl IntoIterator<Item = Self>) -> Result<()> {
        let _held = hold();
        for Self { name, target } in filled {
            if let Target::File(part, place, _) = target {
                part.persist(&place).with_context(|| named(&name))?;
            }
        }
        Ok(())
    }
}

/// The permissions of a file that is replaced, without those that would be another owner's.
fn kept(old: &Metadata) -> Permissions {
    #[cfg(unix)]
    return Permissions::from_mode(old.permissions().mode() & 0o777);
    #[cfg(not(unix))]
    old.permissions()
}

#[cfg(test)]
mod tests {
    use std::thread;

    use super::*;

    fn new(path: &Path, bytes: &[u8]) -> Result<PathBuf> {
        write_new(path, |file| Ok(file.write_all(bytes)?))
    }

    #[test]
    fn new_files_find_a_free_name() {
        let dir = tempfile::TempDir::new().expect("a folder");
        let path = dir.path().join("drive.npz");
        let name = |path: PathBuf| path.file_name().expect("a name").to_string_lossy().into_owned();
        assert_eq!(name(new(&path, b"1").expect("written")), "drive.npz");
        fs::write(dir.path().join("drive-2.npz"), "mine").expect("a file");
        assert_eq!(name(new(&path, b"3").expect("written")), "drive-3.npz");
        let (one, two) = (fs::read(&path).expect("1"), fs::read(dir.path().join("drive-2.npz")).expect("2"));
        assert_eq!((&one[..], &two[..]), (&b"1"[..], &b"mine"[..]));
        // At once, everyone gets a name of their own, and nothing else is left.
        let write = |i: u8| new(&path, &[i]).expect("written");
        thread::scope(|scope| (0..8).for_each(|i| drop(scope.spawn(move || write(i)))));
        assert_eq!(fs::read_dir(dir.path()).expect("a folder").count(), 3 + 8);
        let missing = dir.path().join("no").join("drive.npz");
        assert!(check_new(&path).is_ok() && check_new(&missing).is_err() && new(&missing, b"").is_err());
        assert_eq!(numbered(Path::new("a/b"), 12), Path::new("a/b-12"));
    }
}
