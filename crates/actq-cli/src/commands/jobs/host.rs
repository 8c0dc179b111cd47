//! The interface between jobs and this command.

use std::path::{Path, PathBuf};
use std::{env, fs, io};

use actq::data::Dataset;
use actq::error::{Error, Result};
use actq::methods::Method;
use actq::policy::Policy;
use actq_jobs::error::{AGAIN, JobError};
use actq_jobs::host::{Host, Rolled, Rollout};
use anyhow::Context as _;
use clap::ValueEnum as _;

use crate::args::MethodArg;
use crate::commands::drive::{CommandFailed, DriveCommand, RECORDER_TIMEOUT, load_recordings};
use crate::importers::{self, source_files};
use crate::outputs::files;
use crate::outputs::unfinished::Scratch;
use crate::serve::wait_for_recorders;

/// Name of the spec's command in errors.
const NAME: &str = "the drive command";

/// The command `actq`, whose methods are those of the library.
#[derive(Clone, Copy, Debug)]
pub struct Command;

impl Host for Command {
    fn load(&self, policy: &Path) -> Result<Policy> {
        importers::load(policy).map_err(Error::other)
    }

    fn files(&self, policy: &Path) -> Vec<PathBuf> {
        source_files(policy)
    }

    fn recorded(&self, policy: &Policy, recording: &Path) -> Result<Dataset> {
        importers::recorded(policy, recording)
    }

    fn method(&self, name: &str) -> Result<Method> {
        let known = MethodArg::from_str(name, false)
            .map_err(|_| Error::input(format!("method {name:?} is unknown; use rtn, gptq or distill")))?;
        known.method().map_err(Error::other)
    }

    fn write(&self, path: &Path, bytes: &[u8]) -> Result<()> {
        files::write(path, bytes).map_err(Error::other)
    }

    fn drive(&self, rollout: &Rollout<'_>) -> Result<Rolled, JobError> {
        let run = || -> anyhow::Result<Rolled> {
            let actq = env::current_exe().context("cannot find the running executable")?;
            let policy = fs::canonicalize(rollout.policy).with_context(|| rollout.policy.display().to_string())?;
            let scratch = Scratch::new().context("cannot create a temporary folder")?;
            let command = DriveCommand {
                name: NAME,
                command: rollout.command,
                folder: rollout.folder,
                actq: &actq,
                policy: &policy,
                image: rollout.image,
                recordings: rollout.record.map(|_| scratch.path()),
            };
            let seeds = [("ACTQ_SEED", rollout.first.to_string()), ("ACTQ_EPISODES", rollout.count.to_string())];
            let outcome = command.run(&seeds)?;
            let Some(sizes) = rollout.record else { return Ok(Rolled { outcome, recordings: Vec::new() }) };
            if !wait_for_recorders(scratch.path(), RECORDER_TIMEOUT) {
                let timeout = RECORDER_TIMEOUT.as_secs();
                let message = format!("{NAME} ended, but its policy still records after {timeout} s");
                // Part of the recording would be another result.
                return Err(CommandFailed { message, code: None }.into());
            }
            Ok(Rolled { outcome, recordings: load_recordings(NAME, scratch.path(), sizes)? })
        };
        run().map_err(|error| {
            let again = match error.downcast_ref::<CommandFailed>() {
                // A signal, or the status by which the command asks for it.
                Some(failed) => failed.code.is_none_or(|code| code == i32::from(AGAIN)),
                None => error.chain().any(|cause| cause.is::<io::Error>()),
            };
            JobError { again, error: Error::other(error) }
        })
    }
}
