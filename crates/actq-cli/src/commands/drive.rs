//! The `--drive` command: a simulator or a robot that rolls out an image by `actq serve`.

use std::error::Error;
use std::io::{self, BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;
use std::{env, fmt, fs};

use actq::data::{Dataset, Sizes, files_of};
use actq::pipeline::driven::{DriveOutcome, Driven};
use actq::policy::Policy;
use actq::text::quoted;
use anyhow::{Context as _, Result};

use crate::group;
use crate::outputs::files;
use crate::serve::wait_for_recorders;
use crate::terminal::note;

/// The most time for recorders to write their last episode after the command has ended.
pub(crate) const RECORDER_TIMEOUT: Duration = Duration::from_secs(60);

/// The command, and the folder of images and recordings.
pub(crate) struct Drive<'a> {
    /// Command line for `sh -c`.
    pub(crate) command: &'a str,
    /// Path of this executable.
    actq: PathBuf,
    /// The policy folder.
    policy: PathBuf,
    sizes: Sizes,
    folder: PathBuf,
}

impl<'a> Drive<'a> {
    /// Prepares rollouts with images and recordings in `folder`, which must exist.
    pub(crate) fn new(command: &'a str, policy: &Policy, folder: &Path) -> Result<Self> {
        let absolute =
            |path: &Path| fs::canonicalize(path).with_context(|| format!("{}: cannot find the folder", path.display()));
        let actq = env::current_exe().context("cannot find the running executable")?;
        let (policy_dir, folder) = (absolute(&policy.dir)?, absolute(folder)?);
        Ok(Self { command, actq, policy: policy_dir, sizes: Sizes::of(policy), folder })
    }

    /// Rolls out the image of a round by the command, and loads the recordings.
    pub(crate) fn run(&self, round: usize, image: &[u8]) -> Result<Driven> {
        let path = self.folder.join(format!("round-{round}.actq"));
        files::write(&path, image)?;
        let recordings = self.folder.join(format!("round-{round}"));
        fs::create_dir(&recordings).with_context(|| format!("{}: cannot create the folder", recordings.display()))?;
        let run = DriveCommand {
            name: "the --drive command",
            command: self.command,
            folder: None,
            actq: &self.actq,
            policy: &self.policy,
            image: &path,
            recordings: Some(&recordings),
        };
        let outcome = run.run(&[("ACTQ_ROUND", (round + 1).to_string())])?;
        if !wait_for_recorders(&recordings, RECORDER_TIMEOUT) {
            note([format!(
                "{}: a recorder is still writing after {} s; continuing with the recordings that are complete",
                recordings.display(),
                RECORDER_TIMEOUT.as_secs()
            )]);
        }
        let recordings = load_recordings("the --drive command", &recordings, self.sizes)?;
        if outcome.as_ref().and_then(DriveOutcome::success).is_none() {
            note([
                "the --drive command printed no line with one JSON object that holds a number \"success\"".to_owned()
            ]);
        }
        Ok(Driven { recordings, outcome: outcome.unwrap_or_default() })
    }
}

/// Loads the recordings that a command, called `name` in errors, has written to a folder.
pub(crate) fn load_recordings(name: &str, folder: &Path, sizes: Sizes) -> Result<Vec<Dataset>> {
    let files = files_of(&[folder.to_owned()]).with_context(|| {
        format!(
            "{name} recorded nothing; it must run the command line in the environment variable POLICY_CMD as its policy, over \
             standard input and output (actq serve --help documents the protocol)"
        )
    })?;
    Ok(files.iter().map(|file| Dataset::load(file, sizes)).collect::<Result<Vec<_>, _>>()?)
}

/// A run of a command with an image as its policy.
pub(crate) struct DriveCommand<'a> {
    /// Its name in errors.
    pub(crate) name: &'a str,
    /// Command line for `sh -c`.
    pub(crate) command: &'a str,
    /// Folder that it runs in; `None`: the present one.
    pub(crate) folder: Option<&'a Path>,
    /// Path of this executable.
    pub(crate) actq: &'a Path,
    /// The policy that the image was made from.
    pub(crate) policy: &'a Path,
    pub(crate) image: &'a Path,
    /// Folder for the recordings, if the observations are to be kept.
    pub(crate) recordings: Option<&'a Path>,
}

/// A command that ended with a failure.
#[derive(Debug)]
pub(crate) struct CommandFailed {
    pub(crate) message: String,
    /// Its exit status, if no signal ended it.
    pub(crate) code: Option<i32>,
}

impl fmt::Display for CommandFailed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl Error for CommandFailed {}

impl DriveCommand<'_> {
    /// Runs the command with more variables in its environment, and returns the outcome that it reported. Its output
    /// goes to standard error.
    ///
    /// # Errors
    ///
    /// [`CommandFailed`] if it fails.
    pub(crate) fn run(&self, variables: &[(&str, String)]) -> Result<Option<DriveOutcome>> {
        let name = self.name;
        let record = self.recordings.map(|folder| folder.join("drive.npz"));
        let mut words = vec![self.actq.as_os_str(), "serve".as_ref(), self.image.as_os_str()];
        if let Some(record) = &record {
            words.extend(["--record".as_ref(), record.as_os_str()]);
        }
        let policy_command = words.into_iter().map(quoted).collect::<Result<Vec<_>, _>>()?.join(" ");
        let mut shell = Command::new("sh");
        shell
            .args(["-c", self.command])
            .env_remove("ACTQ_ROUND")
            .env("POLICY_CMD", &policy_command)
            .env("ACTQ_POLICY", self.policy)
            .envs(variables.iter().map(|(key, value)| (key, value)))
            .stdin(Stdio::null())
            .stdout(Stdio::piped());
        if let Some(folder) = self.folder {
            shell.current_dir(folder);
        }
        let mut child = group::spawn(&mut shell).with_context(|| format!("cannot start `sh` to run {name}"))?;
        let mut outcome = None;
        if let Some(output) = child.stdout.take() {
            let mut lines = BufReader::new(output);
            let mut line = Vec::new();
            while lines.read_until(b'\n', &mut line).with_context(|| format!("cannot read the output of {name}"))? > 0 {
                // A closed standard error is not an error.
                drop(io::stderr().write_all(&line));
                outcome = DriveOutcome::parse(&String::from_utf8_lossy(&line)).or(outcome);
                line.clear();
            }
        }
        let status = group::wait(child).with_context(|| format!("cannot wait for {name}"))?;
        if !status.success() {
            // Rounds have their images in a folder that only --keep keeps.
            let kept = if self.recordings.is_some() { "with --keep DIR, " } else { "" };
            let message = format!(
                "{name} failed ({status}): {}; to see why, {kept}run it alone with POLICY_CMD={} in the environment",
                self.command,
                quoted(policy_command.as_ref())?
            );
            return Err(CommandFailed { message, code: status.code() }.into());
        }
        Ok(outcome)
    }
}
