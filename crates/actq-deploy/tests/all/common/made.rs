//! Bundles that tests write, and published ones, which are in the folder that `ACTQ_SHARED` names.

use actq::error::{Context as _, Error, Result, ensure};
use actq_deploy::description::Description;
use actq_deploy::{Answers, Bundle, Plan, Reading, Reference, read};
use sha2::{Digest as _, Sha256};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

use super::network::{network, tensors};

/// Returns a file or folder of the shared folder, or nothing without it.
pub(crate) fn shared_file(path: &str) -> Option<PathBuf> {
    match std::env::var_os("ACTQ_SHARED") {
        Some(folder) => Some(PathBuf::from(folder).join(path)),
        None => {
            println!("not run: ACTQ_SHARED does not name the shared folder");
            None
        }
    }
}

/// Returns the folder of a published bundle, or nothing without the shared folder.
pub(crate) fn shared(name: &str) -> Option<PathBuf> {
    shared_file(&format!("bundles/{name}"))
}

/// Asserts that a published bundle agrees with a reference, with the family's profile accepted.
pub(crate) fn agrees(name: &str, expect: &str, answers: &str) -> Result<()> {
    let Some(folder) = shared(name) else { return Ok(()) };
    let bundle = Bundle::open(&folder.join("bundle"))?;
    let reading = read(&bundle, true, Answers::parse(answers)?)?;
    ensure!(reading.questions.is_empty(), "{name}: {:#?}", reading.questions);
    let text = reading.description.to_toml(&reading.sources)?;
    ensure!(
        Description::parse(&text)? == reading.description,
        "{name}: deploy.toml does not keep the description: {text}"
    );
    let reference = Reference::read(&folder.join("raw.npz"), &folder.join(expect))?;
    let comparison = reference.compare(&reading.description, &bundle)?;
    println!("{name}, {expect}: {:?}, unread {:?}", comparison.largest, reading.unread);
    ensure!(reading.unread.is_empty(), "{name}: nothing reads {:?}", reading.unread);
    ensure!(
        comparison.first.is_none(),
        "{name}: {}",
        comparison.first.map_or_else(String::new, |first| first.to_string())
    );
    Ok(())
}

/// Returns the message of an error with its contexts.
pub(crate) fn message(result: Result<Reading>) -> String {
    result.map_or_else(|error| format!("{error:#}"), |reading| format!("accepted: {:?}", reading.description))
}

/// Asserts that a bundle was refused with a message that contains `expected`; `name` tells what is wrong with it.
pub(crate) fn refused(name: &str, result: Result<Reading>, expected: &str) -> Result<()> {
    let error = message(result);
    ensure!(error.contains(expected), "{name}: {error}");
    Ok(())
}

/// The files of a bundle that a test makes, by their names: a name ending in `.onnx.toml`, `.kinfer.toml` or
/// `.safetensors.toml` is that of a file that its text describes. In a YAML file, `HASH name` is the SHA-256 of a file.
#[derive(Clone, Default)]
pub(crate) struct Files(pub(crate) BTreeMap<String, Vec<u8>>);

impl Files {
    /// Reads a fixture.
    pub(crate) fn read(folder: &Path) -> Result<Self> {
        let bundle = Bundle::open(folder)?;
        let read = |name: &str| Ok((name.to_owned(), fs::read(folder.join(name))?));
        bundle.files().map(read).collect::<Result<_>>().map(Self)
    }

    /// Adds or replaces a file.
    pub(crate) fn with_file(&self, name: &str, bytes: impl Into<Vec<u8>>) -> Self {
        let mut files = self.clone();
        files.0.insert(name.to_owned(), bytes.into());
        files
    }

    /// Makes the files that texts describe.
    fn made(&self) -> Result<BTreeMap<String, Vec<u8>>> {
        let make = |(name, bytes): (&String, &Vec<u8>)| {
            let of = |ending: &str| name.strip_suffix(".toml").filter(|name| name.ends_with(ending));
            let text = String::from_utf8_lossy(bytes);
            Ok(match (of(".onnx").or(of(".kinfer")), of(".safetensors")) {
                (Some(name), _) => (name.to_owned(), network(&text).with_context(|| name.to_owned())?),
                (_, Some(name)) => (name.to_owned(), tensors(&text).with_context(|| name.to_owned())?),
                _ => (name.clone(), bytes.clone()),
            })
        };
        let mut files: BTreeMap<String, Vec<u8>> = self.0.iter().map(make).collect::<Result<_>>()?;
        let hash = |bytes| Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect::<String>();
        let hashes: Vec<_> = files.iter().map(|(name, bytes)| (format!("HASH {name}"), hash(bytes))).collect();
        for (_, bytes) in files.iter_mut().filter(|(name, _)| name.ends_with("yaml")) {
            let text = String::from_utf8_lossy(bytes).into_owned();
            *bytes = hashes.iter().fold(text, |text, (name, hash)| text.replace(name, hash)).into_bytes();
        }
        Ok(files)
    }

    /// Runs `work` with the bundle in a folder.
    fn written<T>(&self, work: impl FnOnce(&Bundle) -> Result<T>) -> Result<T> {
        let folder = TempDir::new()?;
        for (name, bytes) in self.made()? {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().context("a folder")?)?;
            fs::write(path, bytes)?;
        }
        let shown = folder.path().display().to_string();
        let named = |error: Error| Error::input(format!("{error:#}").replace(&shown, "BUNDLE"));
        work(&Bundle::open(folder.path())?).map_err(named)
    }

    pub(crate) fn reading(&self, accepted: bool, answers: &str) -> Result<Reading> {
        self.reading_by(None, accepted, answers)
    }

    /// Reads the bundle by the user's profile, if there is one.
    pub(crate) fn reading_by(&self, profile: Option<&str>, accepted: bool, answers: &str) -> Result<Reading> {
        self.written(|bundle| {
            let bundle = profile.map_or_else(|| bundle.clone(), |text| bundle.clone().with_profile(text));
            read(&bundle, accepted, Answers::parse(answers)?)
        })
    }

    pub(crate) fn plan(&self, description: &Description) -> Result<Plan> {
        self.written(|bundle| Plan::new(description, bundle))
    }
}
