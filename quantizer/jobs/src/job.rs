//! One job: the work, the digests of its inputs, the jobs that it needs, and its address.

use std::path::PathBuf;

use actq::error::{Context as _, Result, ensure};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::digest::{is_digest, of_bytes, of_file};

/// The version that results depend on: that of this package.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// A job.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Line", into = "Line")]
pub struct Job {
    /// SHA-256 of kind, options (with the addresses of other jobs and the seed), inputs and version.
    pub address: String,
    /// Name for messages; not part of the address.
    pub title: String,
    /// The work.
    pub work: Work,
    /// Files that it reads.
    pub inputs: Vec<Input>,
    /// Addresses of the jobs whose results it reads.
    pub deps: Vec<String>,
    /// Number of the stage: 0 without dependencies, else one more than the largest of the dependencies.
    pub stage: usize,
    /// Cores that it uses.
    pub cpus: usize,
    /// Estimated memory in MiB.
    pub memory_mib: u64,
    /// Estimated seconds.
    pub seconds: f64,
}

/// A job as a line of JSON.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Line {
    kind: String,
    title: String,
    address: String,
    version: String,
    stage: usize,
    options: Value,
    inputs: Vec<Input>,
    deps: Vec<String>,
    cpus: usize,
    memory_mib: u64,
    seconds: f64,
}

/// A file that a job reads.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Input {
    /// Meaning of the file.
    pub role: Role,
    /// The file; only its name is part of the address.
    pub path: PathBuf,
    /// SHA-256 of its content.
    pub sha256: String,
}

/// Meaning of an input.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// A file that the policy is read from.
    Policy,
    /// The recording that is learned from.
    Calib,
    /// The recording that errors are measured on.
    Heldout,
    /// A file that the drive command depends on.
    Command,
}

/// The work of a job.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", content = "options", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Work {
    /// Makes an image.
    Quantize(Make),
    /// Measures an image on episodes of the held-out recording.
    Evaluate(Evaluate),
    /// Runs closed-loop episodes of an image.
    Drive(Drive),
    /// Makes an image that also learns from earlier images' rollouts.
    Learn(Learn),
    /// Puts the results of a plan into one.
    Merge(Merge),
}

/// An image to make.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Make {
    /// The policy's path, as importers read it; only its last part is part of the address.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub policy: Option<PathBuf>,
    /// The method's name.
    pub method: String,
    /// Budget in bits per weight.
    pub bpw: f64,
    /// Most steps of distillation; `None`: chosen for the network.
    pub steps: Option<usize>,
    /// `true` if errors are weighed relative to the action's size.
    pub relative: bool,
    /// Seed of all random numbers.
    pub seed: u64,
}

/// A range of episodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Episodes {
    /// Seed of the first episode; of a recording, its number.
    pub first: u64,
    /// Number of episodes.
    pub count: u64,
}

/// A measurement on the held-out recording.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Evaluate {
    /// Address of the image's job.
    pub image: String,
    /// The policy's path; see [`Make::policy`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub policy: Option<PathBuf>,
    /// Episodes of the recording.
    pub episodes: Episodes,
}

/// Closed-loop episodes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Drive {
    /// Address of the image's job.
    pub image: String,
    /// The policy's path; see [`Make::policy`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub policy: Option<PathBuf>,
    /// Folder that the command runs in; not part of the address.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub folder: Option<PathBuf>,
    /// Command line for `sh -c`.
    pub command: String,
    /// Seeds of the episodes.
    pub seeds: Episodes,
    /// `true` if the observations are kept to learn from.
    pub record: bool,
}

/// An image of an on-policy round.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Learn {
    /// The image.
    pub make: Make,
    /// The round, from 1.
    pub round: usize,
    /// Addresses of the drive jobs whose recordings are learned from, in order.
    pub recordings: Vec<String>,
}

/// Results to merge.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Merge {
    /// Names of the policies.
    pub policies: Vec<String>,
    /// Images, in the order of the tables.
    pub rows: Vec<Row>,
}

/// One image's jobs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Row {
    /// Index of its policy in [`Merge::policies`].
    pub policy: usize,
    /// The method's name.
    pub method: String,
    /// Budget in bits per weight.
    pub bpw: f64,
    /// Seed.
    pub seed: u64,
    /// The on-policy round; 0 without.
    pub round: usize,
    /// Address of the job that makes the image.
    pub image: String,
    /// Addresses of its evaluations.
    pub evaluations: Vec<String>,
    /// Addresses of its closed-loop episodes.
    pub drives: Vec<String>,
}

impl Work {
    /// Returns the name of the kind.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Quantize(_) => "quantize",
            Self::Evaluate(_) => "evaluate",
            Self::Drive(_) => "drive",
            Self::Learn(_) => "learn",
            Self::Merge(_) => "merge",
        }
    }

    /// Returns the addresses of the jobs whose results are read, each one time.
    pub fn deps(&self) -> Vec<String> {
        let mut deps: Vec<String> = match self {
            Self::Quantize(_) => Vec::new(),
            Self::Evaluate(Evaluate { image, .. }) | Self::Drive(Drive { image, .. }) => vec![image.clone()],
            Self::Learn(learn) => learn.recordings.clone(),
            Self::Merge(merge) => {
                let of_row = |row: &Row| [&[row.image.clone()][..], &row.evaluations, &row.drives].concat();
                merge.rows.iter().flat_map(of_row).collect()
            }
        };
        deps.sort_unstable();
        deps.dedup();
        deps
    }

    /// Returns the work without paths, which may differ between machines.
    fn without_paths(&self) -> Self {
        let mut work = self.clone();
        match &mut work {
            Self::Quantize(make) | Self::Learn(Learn { make, .. }) => make.policy = None,
            Self::Evaluate(evaluate) => evaluate.policy = None,
            Self::Drive(drive) => (drive.policy, drive.folder) = (None, None),
            Self::Merge(_) => (),
        }
        work
    }
}

impl Input {
    /// Makes an input of a file, with the digest of its present content.
    ///
    /// # Errors
    ///
    /// If the file cannot be read.
    pub fn of(role: Role, path: PathBuf) -> Result<Self> {
        let sha256 = of_file(&path)?;
        Ok(Self { role, path, sha256 })
    }
}

/// Returns the address of a work with its inputs.
pub(crate) fn address(work: &Work, inputs: &[Input]) -> Result<String> {
    let mut files = Vec::new();
    for input in inputs {
        let name = input.path.file_name().context("an input has no file name")?.to_string_lossy();
        files.push((input.role, name, &input.sha256));
    }
    // The fields are serialized in the order of their declaration.
    Ok(of_bytes(serde_json::to_string(&("actq-job-1", VERSION, work.without_paths(), files))?.as_bytes()))
}

impl From<Job> for Line {
    fn from(job: Job) -> Self {
        let Job { address, title, work, inputs, deps, stage, cpus, memory_mib, seconds } = job;
        let mut value = serde_json::to_value(&work).unwrap_or_default();
        let options = value.get_mut("options").map(Value::take).unwrap_or_default();
        let (kind, version) = (work.kind().to_owned(), VERSION.to_owned());
        Self { kind, title, address, version, stage, options, inputs, deps, cpus, memory_mib, seconds }
    }
}

impl TryFrom<Line> for Job {
    /// The whole message, as a reader of JSON shows only the outermost one of an error.
    type Error = String;

    fn try_from(line: Line) -> Result<Self, String> {
        Self::of_line(line).map_err(|error| format!("{error:#}"))
    }
}

impl Job {
    fn of_line(line: Line) -> Result<Self> {
        let Line { kind, title, address, version, stage, options, inputs, deps, cpus, memory_mib, seconds } = line;
        ensure!(
            version == VERSION,
            "job {title:?} was planned by version {version} of actq, and this is {VERSION}; plan again, or use that version"
        );
        let minutes = options.get("minutes").or(options.get("make").and_then(|make| make.get("minutes")));
        ensure!(
            minutes.is_none(),
            "job {title:?} has the option minutes: learning that time limits is not reproducible; use steps"
        );
        let work: Work = serde_json::from_value(serde_json::json!({"kind": kind, "options": options}))
            .with_context(|| format!("job {title:?}"))?;
        let job = Self { address, title, work, inputs, deps, stage, cpus, memory_mib, seconds };
        job.check()?;
        Ok(job)
    }

    /// Refuses a job whose address or dependencies are not those of its content.
    fn check(&self) -> Result<()> {
        let title = &self.title;
        ensure!(
            self.deps.iter().all(|dep| is_digest(dep)),
            "job {title:?}: a dependency is not an address of 64 hexadecimal digits"
        );
        ensure!(!self.deps.contains(&self.address), "job {title:?}: depends on itself");
        ensure!(
            self.deps == self.work.deps(),
            "job {title:?}: \"deps\" are not the addresses in its options; plan again"
        );
        ensure!(
            self.address == address(&self.work, &self.inputs)?,
            "job {title:?}: its content does not have the address {}; a job must not be edited: change the spec and plan again",
            self.address
        );
        Ok(())
    }
}
