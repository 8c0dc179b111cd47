//! Writing files: each whole or not at all, all or none, and never over what the command reads.

use std::fs::{self, File, Metadata, OpenOptions, Permissions};
use std::io::{ErrorKind, Write as _};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use tempfile::NamedTempFile;

/// Links from one to the next that are followed; as many as Linux follows.
const MOST_LINKS: usize = 40;

/// Writes `bytes` to `path` so that neither a failure nor an end of the process leaves part of a file there. (A process that is
/// killed while it writes can leave a hidden file of this name with the ending .part.)
///
/// A symbolic link stays, and what it points to is written. A file that is replaced keeps its permissions; one that is read-only
/// is refused. A device or pipe is written to as it is.
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    write_all(&[(path, bytes)])
}

/// Writes all files, each as [`write()`] does, or none where one of them cannot be written. What a device or pipe was given is
/// given.
pub fn write_all(files: &[(&Path, impl AsRef<[u8]>)]) -> Result<()> {
    // Everything that is likely to fail is done before the first file takes its place.
    let staged = files.iter().map(|(path, bytes)| stage(path, bytes.as_ref()).with_context(|| named(path)));
    for (staged, (path, bytes)) in staged.collect::<Result<Vec<_>>>()?.into_iter().zip(files) {
        match staged {
            Staged::File(file, place) => file.persist(place).map(drop).map_err(|e| e.error),
            Staged::Stream(mut stream) => stream.write_all(bytes.as_ref()),
        }
        .with_context(|| named(path))?;
    }
    Ok(())
}

/// Refuses, before any work is done, outputs that are one of the command's `inputs` or each other, under whatever names, and
/// outputs that have no place. An input that does not exist counts as well: a file of its name would be read the next time.
pub fn check_outputs(outputs: &[&Path], inputs: &[PathBuf]) -> Result<()> {
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
    Ok(())
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
        use std::os::unix::fs::MetadataExt as _;
        return Some(Identity::Inode(file.dev(), file.ino()));
    }
    fs::canonicalize(path).or_else(|_| follow(path)).ok().map(Identity::Place)
}

/// The path that is meant, its folder resolved and its links followed; a file need not exist there. A link to an open file, as
/// `/dev/stdout` is one in the end, is not followed.
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
    /// A file, and what is replaced there.
    File(PathBuf, Option<Metadata>),
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
            Ok(Place::File(place, Some(old)))
        }
        Ok(_) => Ok(Place::Stream(place)),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(Place::File(place, None)),
        Err(error) => Err(error.into()),
    }
}

/// An output that is ready.
enum Staged {
    /// A file beside its place.
    File(NamedTempFile, PathBuf),
    /// Opened.
    Stream(File),
}

fn stage(path: &Path, bytes: &[u8]) -> Result<Staged> {
    let (place, old) = match place(path)? {
        Place::File(place, old) => (place, old),
        Place::Stream(place) => return Ok(Staged::Stream(OpenOptions::new().write(true).open(place)?)),
    };
    let (Some(folder), Some(name)) = (place.parent(), place.file_name()) else { bail!("it names no file") };
    let prefix = format!(".{}.", name.to_string_lossy());
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix).suffix(".part");
    // A temporary file is private to its owner; an output is as readable as the one before it, or as any new file.
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        builder.permissions(Permissions::from_mode(0o666));
    }
    let mut file = builder.tempfile_in(folder)?;
    file.write_all(bytes)?;
    if let Some(old) = old {
        file.as_file().set_permissions(kept(&old))?;
    }
    file.as_file().sync_all()?;
    Ok(Staged::File(file, place))
}

/// The permissions of a file that is replaced, without those that would be another owner's.
fn kept(old: &Metadata) -> Permissions {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        Permissions::from_mode(old.permissions().mode() & 0o777)
    }
    #[cfg(not(unix))]
    old.permissions()
}
