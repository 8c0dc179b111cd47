//! Atomic writing of output files: each is complete or absent, all or none, and no output replaces an input.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fs::{self, File, Metadata, OpenOptions, Permissions};
use std::io::{ErrorKind, Read as _, Write as _};
#[cfg(unix)]
use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _};
use std::path::{Path, PathBuf};

use actq_kernels::Image;
use anyhow::{Context, Result, bail, ensure};

use super::unfinished::{Part, hold};

/// The longest chain of symbolic links that is followed, as in Linux.
const MAX_LINKS: usize = 40;
/// The highest number that is appended to a taken name.
const MAX_NUMBERS: usize = 9999;

/// Writes `bytes` to `path`. A failure or the end of the process leaves no partial file there. (A process that is
/// killed while it writes can leave a hidden file of this name with the ending .part.)
///
/// A symbolic link stays, and its target is written. A replaced file keeps its permissions; a read-only file is
/// refused. A device or pipe is written to directly.
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    reserve(&[path], &[])?.write(&[bytes])
}

/// Writes a file as [`write()`] does, with the content from `fill`.
pub fn write_with(path: &Path, fill: impl FnOnce(&mut File) -> Result<()>) -> Result<()> {
    Output::place_all([Output::new(path)?.fill(fill)?])
}

/// Writes a new file as [`write_with`] does, and returns its name: `path`, or, if that exists, `path` with the first
/// free number from 2 on after its stem. Never replaces a file, even if other processes choose a name at the same time.
pub fn write_new(path: &Path, fill: impl FnOnce(&mut File) -> Result<()>) -> Result<PathBuf> {
    let create = || -> Result<PathBuf> {
        let (folder, name) = folder_and_name(path)?;
        let mut part = Part::new(folder, name)?;
        fill(part.file())?;
        part.file().sync_all()?;
        for number in 1..=MAX_NUMBERS {
            let place = numbered(path, number);
            match part.persist_new(&place) {
                Ok(()) => return Ok(place),
                Err((error, rest)) if error.kind() == ErrorKind::AlreadyExists => part = rest,
                Err((error, _)) => return Err(error.into()),
            }
        }
        bail!("all names up to {} exist; choose another name", numbered(path, MAX_NUMBERS).display())
    };
    create().with_context(|| cannot_write(path))
}

/// Fails, before any work, if [`write_new`] cannot create a file in the folder of `path`.
pub fn check_new(path: &Path) -> Result<()> {
    let check = || -> Result<()> {
        let (folder, name) = folder_and_name(path)?;
        // A temporary file's name is shortened; this finds a name that is too long.
        path.try_exists()?;
        Ok(Part::new(folder, name).map(drop)?)
    };
    check().with_context(|| cannot_write(path))
}

/// Returns `path` for number 1, then `stem-2.ending`, `stem-3.ending` and so on.
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

/// Splits a path into its folder, which must exist, and its file name.
fn folder_and_name(path: &Path) -> Result<(&Path, &OsStr)> {
    let name = path.file_name().context("the path has no file name")?;
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    ensure!(folder.is_dir(), "folder {} does not exist", folder.display());
    Ok((folder, name))
}

/// Outputs of a command, each with an empty temporary file beside its place, so that errors of writing show before any
/// work. The temporary files are removed if the outputs are not written.
#[derive(Debug)]
pub struct Outputs(Vec<Output>);

/// Reserves outputs. Refuses an output that is the same file as one of `inputs` or as another output, under any name,
/// and one that cannot be written. An input that does not exist counts, too: the next run would read a file of its
/// name.
pub fn reserve(outputs: &[&Path], inputs: &[PathBuf]) -> Result<Outputs> {
    let mut before: Vec<(Identity, &Path)> = Vec::new();
    for &output in outputs {
        place(output).with_context(|| cannot_write(output))?;
        refuse_input(output, inputs)?;
        let Some(own) = identity(output) else { continue };
        let name = output.display();
        if let Some((_, other)) = before.iter().find(|(other, _)| *other == own) {
            bail!("{name}: is the same file as {}, another output; choose another file", other.display());
        }
        before.push((own, output));
    }
    outputs.iter().map(|path| Output::new(path)).collect::<Result<_>>().map(Outputs)
}

/// Refuses an output for an image that would replace a file of another kind: a wrong name must not cost a file.
pub fn refuse_foreign(output: &Path) -> Result<()> {
    let is_file = fs::metadata(output).is_ok_and(|metadata| metadata.is_file());
    if !is_file {
        return Ok(());
    }
    let mut start = Vec::new();
    // A file that cannot be read cannot be compared; `reserve` finds out whether it can be written.
    let read = File::open(output).and_then(|file| file.take(4).read_to_end(&mut start));
    ensure!(
        read.is_err() || start.is_empty() || start == Image::MAGIC.to_le_bytes(),
        "{}: exists and is not an actq image; choose another name, or remove it",
        output.display()
    );
    Ok(())
}

/// Refuses an output that would replace a file that an earlier run did not write, unless `force`. Such a file begins
/// with the first line of the new `content`, whatever name is quoted in it; a JSON file has the keys of the new one.
pub fn refuse_unlike(output: &Path, content: &str, force: bool) -> Result<()> {
    let is_file = fs::metadata(output).is_ok_and(|metadata| metadata.is_file());
    if force || !is_file {
        return Ok(());
    }
    let old = fs::read(output).with_context(|| format!("{}: cannot read the existing file", output.display()))?;
    let old = String::from_utf8_lossy(&old);
    let is_like = if content.starts_with('{') {
        keys(&old).is_some_and(|found| Some(found) == keys(content))
    } else {
        unnamed(&old) == unnamed(content)
    };
    ensure!(
        old.is_empty() || is_like,
        "{}: already exists, and actq did not write it; choose another name, or use --force to overwrite",
        output.display()
    );
    Ok(())
}

/// Returns the keys of a JSON object.
fn keys(text: &str) -> Option<BTreeSet<String>> {
    let object: serde_json::Map<String, serde_json::Value> = serde_json::from_str(text).ok()?;
    Some(object.into_iter().map(|(key, _)| key).collect())
}

/// Splits the first line of a text at the name that is quoted in it.
fn unnamed(text: &str) -> (&str, &str) {
    let line = text.lines().next().unwrap_or_default();
    let (Some(first), Some(last)) = (line.find('"'), line.rfind('"')) else { return (line, "") };
    (&line[..first], &line[last..])
}

/// Refuses an output that is one of the inputs, under any name.
pub fn refuse_input(output: &Path, inputs: &[PathBuf]) -> Result<()> {
    let Some(own) = identity(output) else { return Ok(()) };
    match inputs.iter().find(|input| identity(input).is_some_and(|input| input == own)) {
        Some(input) => {
            bail!("{}: is the same file as {}, an input; choose another output", output.display(), input.display())
        }
        None => Ok(()),
    }
}

impl Outputs {
    /// Writes all files, one content for each output in order, or none if one cannot be written. Writes to a device or
    /// pipe cannot be undone.
    pub fn write(self, contents: &[impl AsRef<[u8]>]) -> Result<()> {
        debug_assert_eq!(self.0.len(), contents.len());
        // All steps that are likely to fail come before the first file takes its place.
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

fn cannot_write(path: &Path) -> String {
    format!("{}: cannot write the file", path.display())
}

/// Key that is equal for two names of one file.
#[derive(PartialEq)]
enum Identity {
    /// Device and inode.
    #[cfg(unix)]
    Inode(u64, u64),
    /// Path, for a file that does not exist or a system without inodes.
    Place(PathBuf),
}

fn identity(path: &Path) -> Option<Identity> {
    #[cfg(unix)]
    if let Ok(file) = fs::metadata(path) {
        return Some(Identity::Inode(file.dev(), file.ino()));
    }
    fs::canonicalize(path).or_else(|_| follow(path)).ok().map(Identity::Place)
}

/// Resolves the folder and the symbolic links of a path; the file need not exist. Does not follow a link to an open
/// file, to which `/dev/stdout` leads.
fn follow(path: &Path) -> Result<PathBuf> {
    let mut path = path.to_owned();
    for _ in 0..MAX_LINKS {
        let name = path.file_name().context("the path has no file name")?;
        let parent = match path.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        let parent = fs::canonicalize(parent).with_context(|| format!("folder {}", parent.display()))?;
        let place = parent.join(name);
        match fs::read_link(&place) {
            Ok(target) if !holds_open_files(&parent) => path = parent.join(target),
            _ => return Ok(place),
        }
    }
    bail!("the chain of symbolic links is longer than {MAX_LINKS}");
}

/// Returns `true` if the folder's entries are the open files of a process.
fn holds_open_files(folder: &Path) -> bool {
    folder.starts_with("/proc") || folder == Path::new("/dev/fd")
}

/// Kind and place of an output.
enum Place {
    /// A file, and the permissions of the one that it replaces.
    File(PathBuf, Option<Permissions>),
    /// A device or a pipe.
    Stream(PathBuf),
}

fn place(path: &Path) -> Result<Place> {
    ensure!(!path.is_dir(), "it is a folder; choose the name of a file");
    let place = follow(path)?;
    match fs::metadata(&place) {
        Ok(old) if old.is_file() => {
            let open = place.parent().is_some_and(holds_open_files);
            ensure!(!open, "it is a link to an open file; use the name of the file itself");
            ensure!(!old.permissions().readonly(), "the existing file is read-only; choose another name");
            Ok(Place::File(place, Some(replaced_permissions(&old))))
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
    /// Temporary file beside the place, the place, and the permissions of the file.
    File(Part, PathBuf, Option<Permissions>),
    /// A device or a pipe. It is opened only to write, as opening a pipe waits for its reader.
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
        Ok(Self { name: name.to_owned(), target: target().with_context(|| cannot_write(name))? })
    }

    /// Writes the content to the temporary file, or to the device or pipe.
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
        write().with_context(|| cannot_write(&self.name))?;
        Ok(self)
    }

    /// Moves filled files to their places. A signal can end the process before the first or after the last only.
    fn place_all(filled: impl IntoIterator<Item = Self>) -> Result<()> {
        let _held = hold();
        for Self { name, target } in filled {
            if let Target::File(part, place, _) = target {
                part.persist(&place).with_context(|| cannot_write(&name))?;
            }
        }
        Ok(())
    }
}

/// Returns the permissions of a replaced file, without the set-id and sticky bits.
fn replaced_permissions(old: &Metadata) -> Permissions {
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
        // Concurrent writers get different names, and no temporary file is left.
        let write = |i: u8| new(&path, &[i]).expect("written");
        thread::scope(|scope| (0..8).for_each(|i| drop(scope.spawn(move || write(i)))));
        assert_eq!(fs::read_dir(dir.path()).expect("a folder").count(), 3 + 8);
        let missing = dir.path().join("no").join("drive.npz");
        assert!(check_new(&path).is_ok() && check_new(&missing).is_err() && new(&missing, b"").is_err());
        assert_eq!(numbered(Path::new("a/b"), 12), Path::new("a/b-12"));
    }
}
