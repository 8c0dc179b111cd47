//! The application under QEMU, at the other end of its serial port.

use std::io::{BufRead as _, BufReader, Write as _};
use std::path::Path;
use std::process::{Child, ChildStdin, Stdio};
use std::sync::mpsc::Receiver;
use std::time::Duration;

use actq_boards::Target;
use anyhow::{Context as _, Result};

use crate::qemu::{in_slot, spawn};

/// An application under QEMU, with its serial port in reach: lines of text. It is ended with the value.
#[derive(Debug)]
pub struct Console {
    child: Child,
    stdin: ChildStdin,
    lines: Receiver<String>,
}

/// How long a line may take: a busy machine runs QEMU slowly.
const LINE: Duration = Duration::from_secs(60);

impl Console {
    /// Starts an application, with an image in the slot if one is given.
    pub fn start(target: Target, elf: &Path, slot: Option<&Path>) -> Result<Self> {
        let mut command = target.run_with_serial(elf, "stdio");
        in_slot(&mut command, elf, slot)?;
        let mut child = spawn(command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::inherit()))?;
        let (stdin, stdout) = (child.stdin.take(), child.stdout.take());
        let stdin = stdin.context("no standard input")?;
        let stdout = BufReader::new(stdout.context("no standard output")?);
        let (sender, lines) = std::sync::mpsc::channel();
        // It ends with QEMU's output, or with the receiver.
        std::thread::spawn(move || stdout.lines().map_while(Result::ok).all(|line| sender.send(line).is_ok()));
        Ok(Self { child, stdin, lines })
    }

    /// Sends bytes.
    pub fn send(&mut self, bytes: &[u8]) -> Result<()> {
        self.stdin.write_all(bytes).and_then(|()| self.stdin.flush()).context("QEMU has ended")
    }

    /// The next line.
    pub fn line(&mut self) -> Result<String> {
        self.lines.recv_timeout(LINE).context("the application says nothing")
    }

    /// The lines up to the one that begins so, which is the last.
    pub fn lines_until(&mut self, begin: &str) -> Result<Vec<String>> {
        let mut lines = Vec::new();
        loop {
            let line = self.line().with_context(|| format!("waiting for {begin:?} after {lines:#?}"))?;
            lines.push(line);
            if lines.last().is_some_and(|line| line.starts_with(begin)) {
                return Ok(lines);
            }
        }
    }
}

impl Drop for Console {
    fn drop(&mut self) {
        // Where it has ended already, there is nothing to end.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
