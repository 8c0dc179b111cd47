//! The `--drive` command: a simulator or a robot that rolls out an image by `actq serve`.

use std::io::{self, BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;
use std::{env, fs};

use actq::data::{Dataset, Sizes, files_of};
use actq::pipeline::driven::{DriveOutcome, Driven};
use actq::policy::Policy;
use actq::text::quoted;
use anyhow::{Context as _, Result, ensure};

use crate::group;
use crate::outputs::files;
use crate::serve::wait_for_recorders;
use crate::terminal::note;

/// The most time for recorders to write their last episode after the command has ended.
const RECORDER_TIMEOUT: Duration = Duration::from_secs(60);

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
        let record = recordings.join("drive.npz");
        let words =
            [self.actq.as_os_str(), "serve".as_ref(), path.as_os_str(), "--record".as_ref(), record.as_os_str()];
        let policy_command = words.into_iter().map(quoted).collect::<Result<Vec<_>, _>>()?.join(" ");
        let mut shell = Command::new("sh");
        shell
            .args(["-c", self.command])
            .env("POLICY_CMD", &policy_command)
            .env("ACTQ_POLICY", &self.policy)
            .env("ACTQ_ROUND", (round + 1).to_string())
            .stdin(Stdio::null())
            .stdout(Stdio::piped());
        let mut child = group::spawn(&mut shell).context("cannot start `sh` to run the --drive command")?;
        let mut outcome = None;
        if let Some(output) = child.stdout.take() {
            let mut lines = BufReader::new(output);
            let mut line = Vec::new();
            while lines.read_until(b'\n', &mut line).context("cannot read the output of the --drive command")? > 0 {
                // A closed standard error is not an error.
                drop(io::stderr().write_all(&line));
                outcome = DriveOutcome::parse(&String::from_utf8_lossy(&line)).or(outcome);
                line.clear();
            }
        }
        let status = group::wait(child).context("cannot wait for the --drive command")?;
        ensure!(
            status.success(),
            "the --drive command failed ({status}): {}; to see why, run it alone with POLICY_CMD={} in the environment",
            self.command,
            quoted(policy_command.as_ref())?
        );
        if !wait_for_recorders(&recordings, RECORDER_TIMEOUT) {
            note([format!(
                "{}: a recorder is still writing after {} s; continuing with the recordings that are complete",
                recordings.display(),
                RECORDER_TIMEOUT.as_secs()
            )]);
        }
        let files = files_of(&[recordings]).context(
            "the --drive command recorded nothing; it must run the command line in the environment variable POLICY_CMD as its \
             policy, over standard input and output (actq serve --help documents the protocol)",
        )?;
        let recordings = files.iter().map(|file| Dataset::load(file, self.sizes)).collect::<Result<Vec<_>, _>>()?;
        if outcome.as_ref().and_then(DriveOutcome::success).is_none() {
            note([
                "the --drive command printed no line with one JSON object that holds a number \"success\"".to_owned()
            ]);
        }
        Ok(Driven { recordings, outcome: outcome.unwrap_or_default() })
    }
}
