//! The spec of a sweep, a TOML file.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use actq::error::{Context as _, Error, Result, ensure};
use serde::Deserialize;

/// The most jobs of a plan.
pub const MOST_JOBS: usize = 1_000_000;

/// Policies, methods, budgets, seeds and episodes of a sweep. Every combination becomes an image.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spec {
    /// Policy folders or ONNX files; paths in the spec are relative to its folder.
    pub policies: Vec<PathBuf>,
    /// Methods by name.
    #[serde(default = "methods")]
    pub methods: Vec<String>,
    /// Budgets, in bits per weight.
    pub bpw: Vec<f64>,
    /// Seeds of the quantizer.
    #[serde(default = "seeds")]
    pub seeds: Vec<u64>,
    /// Most steps of distillation; without it, chosen for the network.
    pub steps: Option<usize>,
    /// Refused: learning that time limits depends on the machine.
    minutes: Option<toml::Value>,
    /// `true` if method distill weighs errors relative to the action's size.
    #[serde(default)]
    pub relative: bool,
    /// Cores of a job that makes an image.
    #[serde(default = "one")]
    pub cpus: usize,
    /// Measurement on the held-out recording.
    #[serde(default)]
    pub evaluate: Evaluate,
    /// Closed-loop episodes of every image.
    pub drive: Option<Drive>,
    /// On-policy rounds of method distill.
    pub learn: Option<Learn>,
}

/// Measurement on the held-out recording.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Evaluate {
    /// Episodes of the recording in one job; without it, all.
    pub per_job: Option<usize>,
}

/// Closed-loop episodes.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Drive {
    /// Command line for `sh -c`, run in the spec's folder.
    pub command: String,
    /// Files that the command depends on. A change of one changes the jobs' addresses.
    #[serde(default)]
    pub files: Vec<PathBuf>,
    /// The spec's folder, in which the command runs.
    #[serde(skip)]
    pub folder: Option<PathBuf>,
    /// Episodes of each image.
    pub episodes: u64,
    /// Seed of the first episode.
    pub first_seed: u64,
    /// Episodes in one job; without it, all.
    pub per_job: Option<u64>,
    /// Cores of a job.
    #[serde(default = "one")]
    pub cpus: usize,
    /// Estimated seconds of an episode.
    #[serde(default = "second")]
    pub seconds: f64,
    /// Estimated memory of a job, in MiB.
    #[serde(default = "drive_memory")]
    pub memory_mib: u64,
}

/// On-policy rounds: the image of a round is rolled out, and the next one also learns from that.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Learn {
    /// Rounds after the first image.
    pub rounds: usize,
    /// Episodes of each round.
    pub episodes: u64,
    /// Seed of the first round's first episode; later rounds continue the sequence.
    pub first_seed: u64,
}

fn methods() -> Vec<String> {
    ["rtn", "gptq", "distill"].map(str::to_owned).into()
}

fn seeds() -> Vec<u64> {
    vec![1]
}

fn one() -> usize {
    1
}

fn second() -> f64 {
    1.0
}

fn drive_memory() -> u64 {
    1024
}

impl Spec {
    /// Reads a spec, and makes its paths absolute.
    ///
    /// # Errors
    ///
    /// If the file cannot be read, has an unknown key or a value out of range. Every error names the file and the key.
    pub fn read(path: &Path) -> Result<Self> {
        let read = || {
            let text = fs::read_to_string(path).context("cannot read the file")?;
            let mut spec: Self = toml::from_str(&text).map_err(Error::other)?;
            let file = std::path::absolute(path)?;
            let folder = file.parent().context("the path has no folder")?;
            let files = spec.drive.iter_mut().flat_map(|drive| &mut drive.files);
            spec.policies.iter_mut().chain(files).for_each(|path| *path = folder.join(&*path));
            spec.drive.iter_mut().for_each(|drive| drive.folder = Some(folder.to_owned()));
            spec.check()?;
            Ok(spec)
        };
        read().map_err(|error: Error| error.context(path.display().to_string()))
    }

    /// Checks all values.
    ///
    /// # Errors
    ///
    /// Names the key and the remedy.
    pub fn check(&self) -> Result<()> {
        ensure!(
            self.minutes.is_none(),
            "minutes: learning that time limits gives other images on another machine; use steps instead"
        );
        let empty = [
            ("policies", self.policies.is_empty()),
            ("methods", self.methods.is_empty()),
            ("bpw", self.bpw.is_empty()),
            ("seeds", self.seeds.is_empty()),
        ];
        for (key, is_empty) in empty {
            ensure!(!is_empty, "{key}: the list is empty; name at least one");
        }
        let bits = |bpw: &f64| bpw.is_finite() && *bpw > 0.0;
        ensure!(self.bpw.iter().all(bits), "bpw: {:?}: budgets are numbers above 0", self.bpw);
        distinct("policies", self.policies.iter().map(|path| path.display().to_string()))?;
        distinct("methods", self.methods.iter().cloned())?;
        distinct("bpw", self.bpw.iter().map(f64::to_string))?;
        distinct("seeds", self.seeds.iter().map(u64::to_string))?;
        ensure!(self.cpus > 0, "cpus: 0; a job takes at least 1");
        ensure!(self.evaluate.per_job != Some(0), "evaluate.per_job: 0; use 1 or more episodes");
        if let Some(drive) = &self.drive {
            drive.check()?;
        }
        if let Some(learn) = &self.learn {
            learn.check(self)?;
        }
        Ok(())
    }
}

impl Drive {
    fn check(&self) -> Result<()> {
        ensure!(!self.command.trim().is_empty(), "drive.command: is empty; name the command that runs the episodes");
        ensure!(self.episodes > 0, "drive.episodes: 0; use 1 or more");
        ensure!(self.per_job != Some(0), "drive.per_job: 0; use 1 or more episodes");
        ensure!(self.cpus > 0, "drive.cpus: 0; a job takes at least 1");
        ensure!(self.seconds.is_finite() && self.seconds > 0.0, "drive.seconds: use a number above 0");
        ensure!(
            self.first_seed.checked_add(self.episodes).is_some(),
            "drive.first_seed: the last episode's seed is too large; use a smaller one"
        );
        Ok(())
    }
}

impl Learn {
    fn check(&self, spec: &Spec) -> Result<()> {
        let drive = spec.drive.as_ref().context("learn: needs [drive], whose command rolls the images out")?;
        ensure!((1..=100).contains(&self.rounds), "learn.rounds: {}; use 1 to 100", self.rounds);
        ensure!(self.episodes > 0, "learn.episodes: 0; use 1 or more");
        ensure!(
            spec.methods.iter().any(|method| method == "distill"),
            "learn: only method distill learns; add \"distill\" to methods, or remove [learn]"
        );
        let seeds = (self.rounds as u64).checked_mul(self.episodes).and_then(|n| self.first_seed.checked_add(n));
        let end = seeds.context("learn.first_seed: the last episode's seed is too large; use a smaller one")?;
        let (first, drive_end) = (self.first_seed, drive.first_seed + drive.episodes);
        ensure!(
            end <= drive.first_seed || drive_end <= first,
            "learn: seeds {first} to {} are also seeds of [drive], {} to {}; an image must not be measured on episodes that it has \
             learned from",
            end - 1,
            drive.first_seed,
            drive_end - 1
        );
        Ok(())
    }
}

/// Refuses a value that a list names twice: its jobs would have one address.
fn distinct(key: &str, values: impl Iterator<Item = String>) -> Result<()> {
    let mut seen = BTreeSet::new();
    for value in values {
        ensure!(
            !seen.contains(&value),
            "{key}: {value} is named twice, which would give two jobs one address; remove one"
        );
        seen.insert(value);
    }
    Ok(())
}
