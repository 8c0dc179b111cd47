//! SIGINT, SIGTERM and SIGHUP end the command: immediately and without partial outputs, unless the work ends itself
//! ([`crate::ending`]).

use std::io::{self, IsTerminal as _, Write as _};
use std::{fs, process, thread};

use anyhow::{Context as _, Result};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

use crate::outputs::unfinished::Discard;
use crate::{ending, group, terminal};

/// Starts a thread that waits for the signals. A signal that the parent process ignores stays ignored, as under nohup.
pub(crate) fn watch() -> Result<()> {
    let ignored = ignored();
    let caught = [SIGHUP, SIGINT, SIGTERM].into_iter().filter(|signal| ignored >> (signal - 1) & 1 == 0);
    let mut signals = Signals::new(caught).context("cannot catch signals")?;
    thread::spawn(move || {
        while let Some(signal) = signals.forever().next() {
            if !ending::request_stop(signal) {
                end(signal, || signals.pending().next().is_some());
            }
        }
    });
    Ok(())
}

/// Reads the set of ignored signals from Linux's `/proc`; signal 1 is bit 0.
fn ignored() -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let set = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    set.and_then(|set| u64::from_str_radix(set.trim(), 16).ok()).unwrap_or(0)
}

/// Ends the process. A further signal, which `again` reports, kills the commands that it has started.
fn end(signal: i32, again: impl FnMut() -> bool) {
    // From here on the main thread cannot place files or end the process.
    let discard = Discard::begin();
    group::stop(signal, again);
    let removed = if discard.remove() { ": no output was written" } else { "" };
    // A terminal has echoed ^C at the start of the line.
    let line = if !terminal::clear() && io::stderr().is_terminal() { "\n" } else { "" };
    drop(writeln!(io::stderr(), "{line}actq: interrupted{removed}"));
    process::exit(128 + signal);
}
