//! The folder of results: one file per job, whole or absent.

use std::collections::BTreeMap;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use actq::error::{Context as _, Error, Result, bail, ensure};
use serde::{Deserialize, Serialize};

use crate::digest::{is_digest, of_bytes};
use crate::error::JobError;
use crate::host::Host;
use crate::job::Job;
use crate::record::{FORMAT, Outcome, Record};

/// Name of the file that makes a folder a store.
const HEADER: &str = "store.json";
const NAME: &str = "actq-store";

/// First file of a store.
#[derive(Serialize, Deserialize)]
struct Header {
    format: String,
    version: u32,
}

/// A store. It holds `store.json` with the version of its files, and for each result `ADDRESS.json`, which ends in the
/// SHA-256 of what is before. An image or a recording is beside it, as `ADDRESS.actq` or `ADDRESS.npz`, and is written
/// first; the result has its SHA-256.
#[derive(Clone, Debug)]
pub struct Store {
    folder: PathBuf,
}

impl Store {
    /// Opens a store; makes one in a folder that is absent or empty.
    ///
    /// # Errors
    ///
    /// If the folder holds other files, or a store of another version; if it cannot be made or read.
    pub fn open(folder: &Path, host: &dyn Host) -> Result<Self, JobError> {
        let (store, has_header) = Self::at(folder)?;
        if has_header {
            return Ok(store);
        }
        store.make(host).or_else(|error| match Self::at(folder)? {
            // Another worker has made it since, and may have written results.
            (_, true) => Ok(()),
            (_, false) => Err(error),
        })?;
        Ok(store)
    }

    /// Opens a store to read it, and makes nothing. An empty folder is a store without results.
    ///
    /// # Errors
    ///
    /// As [`Self::open`], and if the folder is absent.
    pub fn open_existing(folder: &Path) -> Result<Self, JobError> {
        let (store, has_header) = Self::at(folder)?;
        if !store.folder.exists() {
            let name = folder.display();
            let text = format!("{name}: there is no such folder; name the folder of the results, or create it");
            return Err(JobError::never(Error::input(text)));
        }
        if !has_header {
            store.refuse_other_files()?;
        }
        Ok(store)
    }

    /// Returns the store in a folder, which may be absent, and `true` if its header is there and of this version.
    fn at(folder: &Path) -> Result<(Self, bool), JobError> {
        let name = folder.display();
        let folder = std::path::absolute(folder).map_err(JobError::never)?;
        let store = Self { folder };
        let is_other = store.folder.exists() && !store.folder.is_dir();
        if is_other {
            return Err(JobError::never(Error::input(format!(
                "{name}: is not a folder; choose the folder of the results"
            ))));
        }
        let path = store.folder.join(HEADER);
        match fs::read(&path) {
            Ok(bytes) => store.check(&bytes).map_err(|error| JobError::never(error.context(name.to_string())))?,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok((store, false)),
            Err(error) => {
                return Err(JobError::again(error).context(format!("{}: cannot read the file", path.display())));
            }
        }
        Ok((store, true))
    }

    fn check(&self, bytes: &[u8]) -> Result<()> {
        let Ok(header) = serde_json::from_slice::<Header>(bytes) else {
            bail!("{HEADER} is not that of a store; choose another folder")
        };
        ensure!(header.format == NAME, "{HEADER} is not that of a store; choose another folder");
        ensure!(
            header.version == FORMAT,
            "is a store of version {}, and this is actq with stores of version {FORMAT}; use the actq that made it, or another \
             folder",
            header.version
        );
        Ok(())
    }

    fn make(&self, host: &dyn Host) -> Result<(), JobError> {
        let name = self.folder.display();
        fs::create_dir_all(&self.folder)
            .map_err(|error| JobError::again(error).context(format!("{name}: cannot create the folder")))?;
        self.refuse_other_files()?;
        let header = Header { format: NAME.to_owned(), version: FORMAT };
        self.write(HEADER, &line(&header)?, host)
    }

    fn refuse_other_files(&self) -> Result<(), JobError> {
        let name = self.folder.display();
        let entries = fs::read_dir(&self.folder)
            .map_err(|error| JobError::again(error).context(format!("{name}: cannot read the folder")))?;
        for entry in entries.flatten() {
            let file = entry.file_name();
            // Another process may be making the same store: hidden files are not yet in place.
            if !file.to_string_lossy().starts_with('.') && file != HEADER {
                let text = format!(
                    "{name}: is not empty, and has no {HEADER}: it holds {}; choose the folder of a store, or an empty one",
                    file.display()
                );
                return Err(JobError::never(Error::input(text)));
            }
        }
        Ok(())
    }

    /// Returns its folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Returns the place of an image.
    pub fn image(&self, address: &str) -> PathBuf {
        self.file(address, "actq")
    }

    /// Returns the place of a recording.
    pub fn recording(&self, address: &str) -> PathBuf {
        self.file(address, "npz")
    }

    /// Returns the place of a file beside a result, by the ending of its name.
    pub fn file(&self, address: &str, ending: &str) -> PathBuf {
        self.folder.join(format!("{address}.{ending}"))
    }

    fn result(&self, address: &str) -> PathBuf {
        self.file(address, "json")
    }

    /// Returns `true` if the store has the result of a job and the file beside it, both whole.
    pub fn has(&self, address: &str) -> bool {
        is_digest(address) && self.read_whole(address).is_ok()
    }

    /// Reads the results of jobs, and checks the files beside them, once.
    pub fn results(&self, jobs: &[Job]) -> Results<'_> {
        let (mut whole, mut damaged) = (BTreeMap::new(), Vec::new());
        for Job { address, .. } in jobs {
            match self.read_whole(address) {
                Ok(result) => drop(whole.insert(address.clone(), result)),
                Err(error) if !error.again => damaged.push(error.error),
                Err(_) => (),
            }
        }
        Results { store: self, whole, damaged }
    }

    /// Reads all results, without the files beside them, in the order of their addresses.
    ///
    /// # Errors
    ///
    /// If the folder cannot be read, or a result is damaged.
    pub fn all(&self) -> Result<Vec<Outcome>, JobError> {
        let name = self.folder.display();
        let entries = fs::read_dir(&self.folder)
            .map_err(|error| JobError::again(error).context(format!("{name}: cannot read the folder")))?;
        let names = entries.flatten().map(|entry| entry.file_name().to_string_lossy().into_owned());
        let addresses = names.filter_map(|name| name.strip_suffix(".json").map(str::to_owned));
        let mut addresses: Vec<String> = addresses.filter(|address| is_digest(address)).collect();
        addresses.sort();
        addresses.iter().map(|address| self.read(address)).collect()
    }

    /// Reads the result of a job, and checks the file beside it.
    ///
    /// # Errors
    ///
    /// As [`Self::read`] and [`Self::read_blob`].
    pub fn read_whole(&self, address: &str) -> Result<Outcome, JobError> {
        let result = self.read(address)?;
        let beside = match &result {
            Outcome::Made(made) => Some((self.image(address), &made.image)),
            Outcome::Driven(driven) => driven.recording.as_ref().map(|sha256| (self.recording(address), sha256)),
            Outcome::Custom(custom) => {
                custom.file.as_ref().map(|file| (self.file(address, &file.ending), &file.sha256))
            }
            Outcome::Impossible(_) | Outcome::Evaluated(_) | Outcome::Merged(_) => None,
        };
        if let Some((path, sha256)) = beside {
            self.read_blob(&path, sha256)?;
        }
        Ok(result)
    }

    /// Reads the result of a job.
    ///
    /// # Errors
    ///
    /// "Again" if there is none yet; "never" if the file is damaged.
    pub fn read(&self, address: &str) -> Result<Outcome, JobError> {
        let path = self.result(address);
        let name = path.display();
        let bytes = match fs::read(&path) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == ErrorKind::NotFound => {
                let text = format!("{name}: the result of this job is missing; run that job first");
                return Err(JobError::again(Error::input(text)));
            }
            Err(error) => return Err(JobError::again(error).context(format!("{name}: cannot read the file"))),
        };
        let damaged = |why: String| {
            let text = format!("{name}: is damaged ({why}); run `actq sweep` or its job again");
            JobError::never(Error::input(text))
        };
        let content = unsealed(&bytes).ok_or_else(|| damaged("its checksum differs".to_owned()))?;
        let record: Record = serde_json::from_slice(&content).map_err(|error| damaged(error.to_string()))?;
        if record.format != FORMAT || record.address != address {
            return Err(damaged(format!("format {}, address {}", record.format, record.address)));
        }
        Ok(record.result)
    }

    /// Reads a file beside a result, and checks its digest.
    ///
    /// # Errors
    ///
    /// If it is missing or does not have the digest.
    pub fn read_blob(&self, path: &Path, sha256: &str) -> Result<Vec<u8>, JobError> {
        let name = path.display();
        let bytes = fs::read(path).map_err(|error| {
            if error.kind() == ErrorKind::NotFound {
                let text = format!("{name}: is missing, and its result is there; run `actq sweep` or its job again");
                return JobError::never(Error::input(text));
            }
            JobError::again(error).context(format!("{name}: cannot read the file"))
        })?;
        if of_bytes(&bytes) != sha256 {
            let text = format!("{name}: is damaged (its checksum differs); run `actq sweep` or its job again");
            return Err(JobError::never(Error::input(text)));
        }
        Ok(bytes)
    }

    /// Writes a result, after the file beside it.
    ///
    /// # Errors
    ///
    /// "Again" if a file cannot be written, as on a full disk; the store then has no part of the result that a reader
    /// would take.
    pub fn write_result(&self, record: &Record, blob: Option<(&Path, &[u8])>, host: &dyn Host) -> Result<(), JobError> {
        if let Some((path, bytes)) = blob {
            host.write(path, bytes).map_err(JobError::again)?;
        }
        self.write(&format!("{}.json", record.address), &sealed(line(record)?), host)
    }

    fn write(&self, name: &str, bytes: &[u8], host: &dyn Host) -> Result<(), JobError> {
        host.write(&self.folder.join(name), bytes).map_err(JobError::again)
    }
}

/// The results of a plan that a store had.
#[derive(Debug)]
pub struct Results<'a> {
    store: &'a Store,
    /// Results that are whole, with the files beside them, by their addresses.
    whole: BTreeMap<String, Outcome>,
    /// What is damaged in a result or in the file beside it.
    pub damaged: Vec<Error>,
}

impl Results<'_> {
    /// Returns `true` if the result of a job is whole.
    pub fn has(&self, address: &str) -> bool {
        self.whole.contains_key(address)
    }

    /// Returns the result of a job.
    ///
    /// # Errors
    ///
    /// As [`Store::read_whole`].
    pub fn get(&self, address: &str) -> Result<Outcome, JobError> {
        self.whole.get(address).map_or_else(|| self.store.read_whole(address), |result| Ok(result.clone()))
    }
}

/// Formats a file of one line.
fn line(value: &impl Serialize) -> Result<Vec<u8>, JobError> {
    let text = serde_json::to_string(value).context("cannot format a result").map_err(JobError::never)?;
    Ok((text + "\n").into_bytes())
}

/// Key of a result's checksum, its last one.
const SEAL: &str = ",\"sha256\":\"";

/// Adds the SHA-256 of a JSON object, a line, as its last key.
fn sealed(line: Vec<u8>) -> Vec<u8> {
    let sha256 = of_bytes(&line);
    let object = line.strip_suffix(b"}\n").unwrap_or(&line);
    [object, SEAL.as_bytes(), sha256.as_bytes(), b"\"}\n"].concat()
}

/// Returns the line that was [`sealed`]; `None` if any byte differs.
fn unsealed(bytes: &[u8]) -> Option<Vec<u8>> {
    let sealed = bytes.strip_suffix(b"\"}\n")?;
    let (rest, sha256) = sealed.split_at_checked(sealed.len().checked_sub(64)?)?;
    let line = [rest.strip_suffix(SEAL.as_bytes())?, b"}\n"].concat();
    (of_bytes(&line).as_bytes() == sha256).then_some(line)
}
