//! A child process whose output is passed on, with a line after each long silence.

use std::io::{self, IsTerminal as _, Read};
use std::process::{Command, Stdio};
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context as _, Result};

/// Silence after which a line reports that the child is still running.
const SILENCE: Duration = Duration::from_secs(10);

/// Runs a command to its end and returns whether it succeeded. `name` is the work that it does.
pub(crate) fn run(command: &mut Command, name: &str) -> Result<bool> {
    pass_on(command, name, SILENCE, &mut io::stdout())
}

fn pass_on(command: &mut Command, name: &str, silence: Duration, out: &mut impl io::Write) -> Result<bool> {
    if io::stdout().is_terminal() {
        command.env("CARGO_TERM_COLOR", "always");
    }
    let start = Instant::now();
    let mut child = command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .with_context(|| format!("cannot start {}", command.get_program().to_string_lossy()))?;
    let (sender, receiver) = mpsc::channel();
    if let (Some(stdout), Some(stderr)) = (child.stdout.take(), child.stderr.take()) {
        let other = sender.clone();
        thread::spawn(move || read(stdout, &sender));
        thread::spawn(move || read(stderr, &other));
    }
    let mut ends_a_line = true;
    loop {
        match receiver.recv_timeout(silence) {
            Ok(bytes) => {
                ends_a_line = bytes.ends_with(b"\n");
                out.write_all(&bytes)?;
                out.flush()?;
            }
            // A grandchild may hold the pipes open after the child has ended.
            Err(RecvTimeoutError::Timeout) if child.try_wait()?.is_some() => break,
            Err(RecvTimeoutError::Timeout) => {
                let line_break = if ends_a_line { "" } else { "\n" };
                writeln!(out, "{line_break}   {name}: still running after {} s", start.elapsed().as_secs())?;
                ends_a_line = true;
            }
            Err(RecvTimeoutError::Disconnected) => break,
        }
    }
    Ok(child.wait().context("cannot wait for the child process")?.success())
}

/// Sends everything that comes from a pipe until it closes.
fn read(mut pipe: impl Read, sender: &Sender<Vec<u8>>) {
    let mut buffer = [0; 4096];
    while let Ok(len @ 1..) = pipe.read(&mut buffer) {
        if sender.send(buffer[..len].to_vec()).is_err() {
            break;
        }
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    fn shell(script: &str, silence: Duration) -> (bool, String) {
        let mut out = Vec::new();
        let ok = pass_on(Command::new("sh").args(["-c", script]), "work", silence, &mut out).expect("sh runs");
        (ok, String::from_utf8(out).expect("text"))
    }

    #[test]
    fn output_and_status_are_passed_on() {
        let long = Duration::from_secs(600);
        assert_eq!(shell("echo a; exit 0", long), (true, "a\n".to_owned()));
        assert_eq!(shell("echo b >&2; exit 3", long), (false, "b\n".to_owned()));
    }

    /// The child waits for the line after its x, so the test does not depend on its speed.
    #[test]
    fn silence_prints_a_line() {
        struct Kept(Vec<u8>, std::path::PathBuf);
        impl io::Write for Kept {
            fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
                self.0.extend(bytes);
                let text = String::from_utf8_lossy(&self.0);
                if text.split_once('x').is_some_and(|(_, rest)| rest.contains("still running")) {
                    std::fs::write(&self.1, "")?;
                }
                Ok(bytes.len())
            }
            fn flush(&mut self) -> io::Result<()> {
                Ok(())
            }
        }
        let seen = std::env::temp_dir().join(format!("actq-relay-{}", std::process::id()));
        let script = format!("printf x; while [ ! -e {} ]; do sleep 0.01; done; echo y", seen.display());
        let mut out = Kept(Vec::new(), seen.clone());
        let command = &mut Command::new("sh");
        let ok = pass_on(command.args(["-c", &script]), "work", Duration::from_millis(20), &mut out);
        let text = String::from_utf8(out.0).expect("text");
        // A slow shell is silent before the x, too.
        let (_, rest) = text.split_once('x').expect("an x");
        assert!(ok.expect("sh runs") && rest.starts_with("\n   work: still running after "), "{text:?}");
        assert!(rest.ends_with("s\ny\n"), "{text:?}");
        std::fs::remove_file(seen).expect("removed");
    }
}
