//! One job: the work, the digests of its inputs, the jobs that it needs, and its address.

use std::path::PathBuf;

use actq::error::{Context as _, Result, ensure};
use actq::pipeline::REVISION;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::digest::{is_digest, of_bytes, of_file};
use crate::work::Work;

/// Returns the version that results depend on: that of this package, and the revision of its images.
pub fn version() -> String {
    format!("{}+{REVISION}", env!("CARGO_PKG_VERSION"))
}

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
    /// The recording beside the policy, which is learned from.
    Calib,
    /// A recording that a user made, which is learned from.
    Recorded,
    /// The recording that errors are measured on.
    Heldout,
    /// A file that the drive command depends on.
    Command,
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

pub(crate) fn address(work: &Work, inputs: &[Input]) -> Result<String> {
    let mut files = Vec::new();
    for input in inputs {
        let name = input.path.file_name().context("an input has no file name")?.to_string_lossy();
        files.push((input.role, name, &input.sha256));
    }
    // The fields are serialized in the order of their declaration.
    Ok(of_bytes(serde_json::to_string(&("actq-job-1", version(), work.without_paths(), files))?.as_bytes()))
}

impl From<Job> for Line {
    fn from(job: Job) -> Self {
        let Job { address, title, work, inputs, deps, stage, cpus, memory_mib, seconds } = job;
        let mut value = serde_json::to_value(&work).unwrap_or_default();
        let options = value.get_mut("options").map(Value::take).unwrap_or_default();
        let (kind, version) = (work.kind().to_owned(), self::version());
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
            version == self::version(),
            "job {title:?} was planned by version {version} of actq, and this is {}; plan again, or use that version",
            self::version()
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
