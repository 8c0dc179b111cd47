//! Closed-loop episodes of a spec.

use std::path::PathBuf;

use actq::error::{Context as _, Result, ensure};
use serde::Deserialize;

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

fn one() -> usize {
    1
}

fn second() -> f64 {
    1.0
}

fn drive_memory() -> u64 {
    1024
}

impl Drive {
    pub(super) fn check(&self) -> Result<()> {
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
    pub(super) fn check(&self, drive: Option<&Drive>, methods: &[String]) -> Result<()> {
        let drive = drive.context("learn: needs [drive], whose command rolls the images out")?;
        ensure!((1..=100).contains(&self.rounds), "learn.rounds: {}; use 1 to 100", self.rounds);
        ensure!(self.episodes > 0, "learn.episodes: 0; use 1 or more");
        ensure!(
            methods.iter().any(|method| method == "distill"),
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
