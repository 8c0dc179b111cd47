//! The interface between jobs and the program that runs them.

use std::path::{Path, PathBuf};

use actq::data::{Dataset, Sizes};
use actq::error::{Error, Result};
use actq::methods::Method;
use actq::pipeline::driven::DriveOutcome;
use actq::policy::Policy;
use serde_json::Value;

use crate::error::JobError;
use crate::job::Job;
use crate::work::Custom;

/// The program that runs the jobs.
pub trait Host {
    /// Reads a policy in any format.
    ///
    /// # Errors
    ///
    /// If a file is missing or damaged.
    fn load(&self, policy: &Path) -> Result<Policy>;

    /// Lists the files that a policy may be read from, without recordings. They need not exist.
    fn files(&self, policy: &Path) -> Vec<PathBuf>;

    /// Reads a recording that a user made for a policy, as what its networks read.
    ///
    /// # Errors
    ///
    /// If it cannot be read, or does not fit the policy.
    fn recorded(&self, policy: &Policy, recording: &Path) -> Result<Dataset>;

    /// Returns a method by its name.
    ///
    /// # Errors
    ///
    /// Names the known methods.
    fn method(&self, name: &str) -> Result<Method>;

    /// Writes a file, which is whole or absent at every time.
    ///
    /// # Errors
    ///
    /// If it cannot be written.
    fn write(&self, path: &Path, bytes: &[u8]) -> Result<()>;

    /// Runs the episodes of a rollout.
    ///
    /// # Errors
    ///
    /// If the command cannot be started or fails.
    fn drive(&self, rollout: &Rollout<'_>) -> Result<Rolled, JobError>;

    /// Does the work of a job of kind custom, with the results that it needs, in its order. The last argument receives
    /// the present work and the share of it that is done.
    ///
    /// # Errors
    ///
    /// If this program has no work of that name, as by default; if it fails.
    fn custom(
        &self,
        job: &Job,
        work: &Custom,
        _needs: &[Needed],
        _watch: &mut dyn FnMut(&str, f64),
    ) -> Result<Found, JobError> {
        let text =
            format!("{:?} is no work of this command; run {:?} by the command that planned it", work.name, job.title);
        Err(JobError::never(Error::input(text)))
    }
}

/// The result of a job of kind custom, for one that needs it.
#[derive(Debug)]
pub struct Needed {
    /// The result.
    pub value: Value,
    /// The file beside it, if it has one.
    pub file: Option<PathBuf>,
}

/// The result of a job of kind custom.
#[derive(Debug)]
pub struct Found {
    /// The result: the same for every try, on every machine.
    pub value: Value,
    /// A file that is kept beside it, with the ending of its name.
    pub file: Option<(&'static str, Vec<u8>)>,
}

/// Closed-loop episodes of an image.
#[derive(Debug)]
pub struct Rollout<'a> {
    /// Command line for `sh -c`.
    pub command: &'a str,
    /// Folder that it runs in.
    pub folder: Option<&'a Path>,
    /// The policy that the image was made from.
    pub policy: &'a Path,
    /// The image.
    pub image: &'a Path,
    /// Seed of the first episode.
    pub first: u64,
    /// Number of episodes.
    pub count: u64,
    /// Sizes of the recording, if the observations are to be kept.
    pub record: Option<Sizes>,
}

/// Outcome of a rollout.
#[derive(Debug)]
pub struct Rolled {
    /// Numbers that the command reported, if any.
    pub outcome: Option<DriveOutcome>,
    /// The observations; empty without [`Rollout::record`].
    pub recordings: Vec<Dataset>,
}
