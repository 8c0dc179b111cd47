//! Bundles that tests write, and published ones, which are in the folder that `ACTQ_SHARED` names.

use actq::error::{Context as _, Result, ensure};
use actq_deploy::description::Description;
use actq_deploy::{Answers, Bundle, Deployment, Plan, Reading, Reference, Runner, read};
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
    let comparison = reference.compare(Plan::new(&reading.description, &bundle)?)?;
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

/// A bundle that a test writes.
pub(crate) struct Made(TempDir);

impl Made {
    pub(crate) fn new() -> Result<Self> {
        Ok(Self(TempDir::new()?))
    }

    /// Writes files by name.
    pub(crate) fn of<N: AsRef<str>, B: AsRef<[u8]>>(files: impl IntoIterator<Item = (N, B)>) -> Result<Self> {
        let made = Self::new()?;
        for (name, bytes) in files {
            made.write(name.as_ref(), bytes.as_ref())?;
        }
        Ok(made)
    }

    pub(crate) fn write(&self, name: &str, bytes: &[u8]) -> Result<()> {
        let path = self.0.path().join(name);
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder)?;
        }
        Ok(fs::write(path, bytes)?)
    }

    pub(crate) fn bundle(&self) -> Result<Bundle> {
        Bundle::open(self.0.path())
    }

    pub(crate) fn reading(&self, accepted: bool, answers: &str) -> Result<Reading> {
        read(&self.bundle()?, accepted, Answers::parse(answers)?)
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
        let plan = Plan::new(&reading.description, &self.bundle()?)?;
        Deployment::new("policy", 50.0, &plan).context("an image of it")?;
        let mut runner = Runner::new(plan);
        let inputs = runner.plan().inputs().to_vec();
        let step = |tick: usize| {
            let given: Vec<Vec<f64>> = inputs.iter().map(|(name, len)| raw(name, *len, tick)).collect();
            let made = runner.step(&given);
            (made.observation, made.targets.into_iter().flat_map(|(_, values)| values).collect())
        };
        Ok((0..ticks).map(step).collect())
    }
}
