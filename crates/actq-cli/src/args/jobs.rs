//! Arguments of the commands for jobs.

use std::path::PathBuf;

use clap::value_parser;

use super::values::threads;

#[derive(clap::Args)]
pub(crate) struct PlanArgs {
    /// The spec (SPEC.toml), or a plan
    pub(crate) spec: PathBuf,
    /// Only jobs of this stage
    #[arg(long, value_name = "N")]
    pub(crate) stage: Option<usize>,
    /// Only jobs whose results this store does not have
    #[arg(long, value_name = "DIR")]
    pub(crate) missing: Option<PathBuf>,
}

/// Arguments of `actq job`.
#[derive(clap::Args, Debug)]
pub struct JobArgs {
    /// A file with one job; - for standard input
    pub(crate) job: PathBuf,
    /// The folder of the results
    #[arg(long, value_name = "DIR")]
    pub(crate) store: PathBuf,
    /// Threads, at most 256, 0 for the default; results do not depend on their number [default: the job's cpus, or
    /// fewer if this process may not use as many]
    #[arg(long, value_name = "N", default_value_t = 0, hide_default_value = true, value_parser = threads)]
    pub(crate) threads: u16,
    /// Print the progress to standard output, one JSON object a line: work and share (0 to 1); at the end address,
    /// cached and seconds
    #[arg(long)]
    pub(crate) progress: bool,
}

#[derive(clap::Args)]
pub(crate) struct MergeArgs {
    /// The spec (SPEC.toml), or a plan
    pub(crate) spec: PathBuf,
    /// The folder of the results
    #[arg(long, value_name = "DIR")]
    pub(crate) store: PathBuf,
    /// Write all figures as JSON
    #[arg(long, value_name = "FILE")]
    pub(crate) json: Option<PathBuf>,
}

/// Options of a sweep by jobs.
#[derive(clap::Args, Clone, Debug)]
pub(crate) struct PoolArgs {
    /// Keep the results of the jobs in this folder, and use those that are there [default: a temporary one]
    #[arg(long, value_name = "DIR")]
    pub(crate) store: Option<PathBuf>,
    /// Most tries of a job that may succeed later
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = value_parser!(u16).range(1..))]
    pub(crate) tries: u16,
    /// Append a line to this file for each job that has run, as JSON: address, title, kind, seconds, status
    #[arg(long, value_name = "FILE")]
    pub(crate) log: Option<PathBuf>,
}
