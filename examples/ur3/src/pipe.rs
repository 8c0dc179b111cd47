//! A policy behind a pipe: any command that speaks the protocol of `actq_link`.

use std::io::{BufReader, Read as _, Write as _};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use actq_link::{RESET, STEP};
use anyhow::{Context, Result, ensure};

use crate::{ACT_DIM, OBS_DIM};

/// A running command that answers observations with actions.
#[derive(Debug)]
pub struct PolicyPipe {
    child: Child,
    requests: ChildStdin,
    answers: BufReader<ChildStdout>,
}

impl PolicyPipe {
    /// Starts a command given in shell syntax.
    ///
    /// # Errors
    /// The command cannot start.
    pub fn start(command: &str) -> Result<Self> {
        let mut shell = Command::new("sh");
        shell.arg("-c").arg(format!("exec {command}")).stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = shell.spawn().with_context(|| format!("start {command}"))?;
        let requests = child.stdin.take().context("the policy has no standard input")?;
        let answers = BufReader::new(child.stdout.take().context("the policy has no standard output")?);
        Ok(Self { child, requests, answers })
    }

    /// Resets the policy; call it before every episode.
    ///
    /// # Errors
    /// The policy has ended.
    pub fn reset(&mut self) -> Result<()> {
        self.requests.write_all(&[RESET]).context("cannot reset the policy")
    }

    /// Returns the next action (joint velocities, rad/s); NaN if the policy has none.
    ///
    /// # Errors
    /// The policy has ended.
    pub fn act(&mut self, obs: &[f32; OBS_DIM]) -> Result<[f32; ACT_DIM]> {
        let request: Vec<u8> = [STEP].into_iter().chain(obs.iter().flat_map(|x| x.to_le_bytes())).collect();
        self.requests.write_all(&request).context("cannot send an observation to the policy")?;
        let mut answer = [0; 4 * ACT_DIM];
        self.answers.read_exact(&mut answer).context("cannot read the policy's action")?;
        let (values, _) = answer.as_chunks::<4>();
        Ok(core::array::from_fn(|i| f32::from_le_bytes(values[i])))
    }

    /// Closes the pipe, and waits until the policy has ended.
    ///
    /// # Errors
    /// The policy has failed.
    pub fn finish(self) -> Result<()> {
        let Self { mut child, requests, answers } = self;
        drop((requests, answers));
        let status = child.wait().context("cannot wait for the policy")?;
        ensure!(status.success(), "the policy failed: {status}");
        Ok(())
    }
}
