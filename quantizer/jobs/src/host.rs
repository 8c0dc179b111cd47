//! What the jobs need from the program that runs them.

use std::path::{Path, PathBuf};

use actq::data::{Dataset, Sizes};
use actq::error::Result;
use actq::methods::Method;
use actq::pipeline::driven::DriveOutcome;
use actq::policy::Policy;

use crate::error::JobError;

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
