//! SIGINT, SIGTERM and SIGHUP end the command: immediately and without partial outputs, or, while [`EndsItself`] lives,
//! by the work itself.

use std::io::{self, IsTerminal as _, Read, Write as _};
use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::Duration;
use std::{fs, process, thread};

use anyhow::{Context as _, Result};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

use crate::outputs::unfinished::Discard;
use crate::{group, terminal};

/// `true` while the work ends by itself after a signal.
static ENDS_ITSELF: AtomicBool = AtomicBool::new(false);
/// The signal that the work was told of; 0 for none.
static TOLD: AtomicI32 = AtomicI32::new(0);

/// Time between two looks at the signal, for work that waits for input.
const LOOK: Duration = Duration::from_millis(20);

/// Work that asks [`told`], and ends by itself at the first signal: it leaves a robot safe. A second signal ends the
/// process immediately.
#[derive(Debug)]
pub(crate) struct EndsItself(());

impl EndsItself {
    pub(crate) fn begin() -> Self {
        ENDS_ITSELF.store(true, Ordering::SeqCst);
        Self(())
    }
}

impl Drop for EndsItself {
    fn drop(&mut self) {
        ENDS_ITSELF.store(false, Ordering::SeqCst);
    }
}

/// Returns the signal that the work was told of, if any.
pub(crate) fn told() -> Option<i32> {
    Some(TOLD.load(Ordering::SeqCst)).filter(|signal| *signal != 0)
}

/// Standard input that ends at a signal, also while nothing arrives.
#[derive(Debug)]
pub(crate) struct Input {
    blocks: Receiver<io::Result<Vec<u8>>>,
    block: io::Cursor<Vec<u8>>,
}

impl Input {
    /// Reads standard input in a thread of its own, which ends with the process.
    pub(crate) fn stdin() -> Self {
        let (sender, blocks) = sync_channel(1);
        thread::spawn(move || {
            let mut stdin = io::stdin().lock();
            loop {
                let mut block = vec![0; 64 << 10];
                let read = stdin.read(&mut block).map(|count| {
                    block.truncate(count);
                    block
                });
                let is_last = read.as_ref().map_or(true, Vec::is_empty);
                if sender.send(read).is_err() || is_last {
                    return;
                }
            }
        });
        Self { blocks, block: io::Cursor::default() }
    }
}

impl Read for Input {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        while self.block.position() == self.block.get_ref().len() as u64 {
            if told().is_some() {
                return Ok(0);
            }
            match self.blocks.recv_timeout(LOOK) {
                Ok(block) => {
                    let block = block?;
                    if block.is_empty() {
                        return Ok(0);
                    }
                    self.block = io::Cursor::new(block);
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Ok(0),
            }
        }
        self.block.read(buffer)
    }
}

/// Starts a thread that waits for the signals. A signal that the parent process ignores stays ignored, as under nohup.
pub(crate) fn watch() -> Result<()> {
    let ignored = ignored();
    let caught = [SIGHUP, SIGINT, SIGTERM].into_iter().filter(|signal| ignored >> (signal - 1) & 1 == 0);
    let mut signals = Signals::new(caught).context("cannot catch signals")?;
    thread::spawn(move || {
        while let Some(signal) = signals.forever().next() {
            let is_told = ENDS_ITSELF.load(Ordering::SeqCst) && TOLD.swap(signal, Ordering::SeqCst) == 0;
            if !is_told {
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
