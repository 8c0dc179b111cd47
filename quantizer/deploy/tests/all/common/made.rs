//! Bundles that tests write, and published ones, which are in the folder that `ACTQ_SHARED` names.

use actq::error::{Context as _, Result, ensure};
use actq_deploy::description::Description;
use actq_deploy::{Answers, Bundle, Deployment, Plan, Reading, Reference, Runner, read};
use sha2::{Digest as _, Sha256};
use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;
use tempfile::TempDir;

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

/// Returns the keys of the questions.
pub(crate) fn asked(reading: &Reading) -> Vec<&str> {
    reading.questions.iter().map(|question| question.key.as_str()).collect()
}

/// The observation of a tick, and its targets, one after the other.
pub(crate) type Tick = (Vec<f64>, Vec<f64>);

/// The files of a bundle that a test makes, by their names. In a YAML file, `HASH name` is the SHA-256 of a file.
#[derive(Clone, Default)]
pub(crate) struct Files(pub(crate) BTreeMap<String, Vec<u8>>);

impl Files {
    /// Adds or replaces a file.
    pub(crate) fn with_file(&self, name: &str, bytes: impl Into<Vec<u8>>) -> Self {
        let mut files = self.clone();
        files.0.insert(name.to_owned(), bytes.into());
        files
    }

    pub(crate) fn without(&self, name: &str) -> Self {
        let mut files = self.clone();
        files.0.remove(name);
        files
    }

    /// Replaces a text that occurs one time in the YAML files.
    #[track_caller]
    pub(crate) fn with(&self, from: &str, to: &str) -> Self {
        let (files, count) = self.replaced("yaml", from, to);
        assert_eq!(count, 1, "{from:?} must occur one time");
        files
    }

    /// Replaces a text wherever the files have it whose names end in `ending`.
    #[track_caller]
    pub(crate) fn with_in(&self, ending: &str, from: &str, to: &str) -> Self {
        let (files, count) = self.replaced(ending, from, to);
        assert!(count > 0, "no {ending} has {from:?}");
        files
    }

    fn replaced(&self, ending: &str, from: &str, to: &str) -> (Self, usize) {
        let (mut files, mut count) = (self.clone(), 0);
        for (_, bytes) in files.0.iter_mut().filter(|(name, _)| name.ends_with(ending)) {
            let text = String::from_utf8_lossy(bytes).into_owned();
            count += text.matches(from).count();
            *bytes = text.replace(from, to).into_bytes();
        }
        (files, count)
    }

    /// Runs `work` with the bundle in a folder.
    fn written<T>(&self, work: impl FnOnce(&Bundle) -> Result<T>) -> Result<T> {
        let folder = TempDir::new()?;
        let hash = |bytes| Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect::<String>();
        let hashes: Vec<_> = self.0.iter().map(|(name, bytes)| (format!("HASH {name}"), hash(bytes))).collect();
        let files = hashes.iter().fold(self.clone(), |files, (name, hash)| files.replaced("yaml", name, hash).0);
        for (name, bytes) in &files.0 {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().context("a folder")?)?;
            fs::write(path, bytes)?;
        }
        work(&Bundle::open(folder.path())?)
    }

    pub(crate) fn reading(&self, accepted: bool, answers: &str) -> Result<Reading> {
        self.written(|bundle| read(bundle, accepted, Answers::parse(answers)?))
    }

    /// Returns the keys of the questions.
    pub(crate) fn asked(&self, accepted: bool, answers: &str) -> Result<Vec<String>> {
        Ok(asked(&self.reading(accepted, answers)?).into_iter().map(str::to_owned).collect())
    }

    pub(crate) fn plan(&self, description: &Description) -> Result<Plan> {
        self.written(|bundle| Plan::new(description, bundle))
    }

    /// Runs a bundle that has no questions besides `answers`, and of which an image can be made. `raw` gives an input's values by its
    /// name, its length and the tick.
    pub(crate) fn run(
        &self,
        answers: &str,
        ticks: usize,
        mut raw: impl FnMut(&str, usize, usize) -> Vec<f64>,
    ) -> Result<Vec<Tick>> {
        let reading = self.reading(true, answers)?;
        ensure!(reading.questions.is_empty() && reading.unread.is_empty(), "{reading:#?}");
        let plan = self.plan(&reading.description)?;
        Deployment::new("policy", 50.0, &plan).context("an image of it")?;
        let mut runner = Runner::new(plan);
        let inputs = runner.plan().inputs().to_vec();
        let step = |tick: usize| {
            let given: Vec<Vec<f64>> = inputs.iter().map(|(name, len)| raw(name, *len, tick)).collect();
            let made = runner.step(&given)?;
            Ok((made.observation, made.targets.into_iter().flat_map(|(_, values)| values).collect()))
        };
        (0..ticks).map(step).collect()
    }
}
