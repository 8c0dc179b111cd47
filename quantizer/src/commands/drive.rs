//! A command that drives an image: a simulator or a robot that takes its actions from `actq serve`.

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

/// How long recorders may take to write their last episode once the command has ended.
const PATIENCE: Duration = Duration::from_secs(60);

/// The command, and where images and recordings are put.
pub(crate) struct Drive<'a> {
    /// Run by `sh -c`.
    pub(crate) command: &'a str,
    /// This executable.
    actq: PathBuf,
    /// The policy's folder.
    policy: PathBuf,
    sizes: Sizes,
    folder: PathBuf,
}

impl<'a> Drive<'a> {
    /// With images and recordings in `folder`, which exists.
    pub(crate) fn new(command: &'a str, policy: &Policy, folder: &Path) -> Result<Self> {
        let absolute =
            |path: &Path| fs::canonicalize(path).with_context(|| format!("{}: cannot be read", path.display()));
        let actq = env::current_exe().context("the path of actq itself is not known")?;
        let (policy_dir, folder) = (absolute(&policy.dir)?, absolute(folder)?);
        Ok(Self { command, actq, policy: policy_dir, sizes: Sizes::of(policy), folder })
    }

    /// Runs the command with the image of a round as its policy, and reads what was recorded.
    pub(crate) fn run(&self, round: usize, image: &[u8]) -> Result<Driven> {
        let path = self.folder.join(format!("round-{round}.actq"));
        files::write(&path, image)?;
        let recordings = self.folder.join(format!("round-{round}"));
        fs::create_dir(&recordings).with_context(|| format!("{}: cannot be made", recordings.display()))?;
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
        let mut child = group::spawn(&mut shell).context("cannot start `sh` to run the command of --drive")?;
        let mut outcome = None;
        if let Some(output) = child.stdout.take() {
            let mut lines = BufReader::new(output);
            let mut line = Vec::new();
            while lines.read_until(b'\n', &mut line).context("the command's output cannot be read")? > 0 {
                // That nobody reads it is no error.
                drop(io::stderr().write_all(&line));
                outcome = DriveOutcome::parse(&String::from_utf8_lossy(&line)).or(outcome);
                line.clear();
            }
        }
        let status = group::wait(child).context("the command of --drive is lost")?;
        ensure!(
            status.success(),
            "the command of --drive has failed ({status}): {}; run it by itself, with POLICY_CMD={} in the environment, to see why",
            self.command,
            quoted(policy_command.as_ref())?
        );
        if !wait_for_recorders(&recordings, PATIENCE) {
            note([format!("{}: is still being recorded to; going on with what is there", recordings.display())]);
        }
        let files = files_of(&[recordings]).context(
            "the command of --drive has recorded nothing: it must run what the environment variable POLICY_CMD holds as its \
             policy, over standard input and output (actq serve --help has the protocol)",
        )?;
        let recordings = files.iter().map(|file| Dataset::load(file, self.sizes)).collect::<Result<Vec<_>, _>>()?;
        if outcome.as_ref().and_then(DriveOutcome::success).is_none() {
            note(["the command has printed no JSON object with a number \"success\" in a line of its own".to_owned()]);
        }
        Ok(Driven { recordings, outcome: outcome.unwrap_or_default() })
    }
}
