//! Output to the terminal: results, notes and progress.

use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use actq::text::{printable, printable_lines};
use anyhow::{Context as _, Result};
use indicatif::{ProgressBar, ProgressStyle};

use crate::outputs::files::{self, Outputs};
use crate::report::progress::{Cadence, Work};

/// Steps of the progress bar.
const STEPS: u64 = 1000;
/// Time between two drawings of a bar without reports.
const REDRAW: Duration = Duration::from_secs(1);

/// `true` if an output of the command goes to standard output.
static STDOUT_IS_TAKEN: AtomicBool = AtomicBool::new(false);
/// Progress of the current work, for other writers to the terminal.
static SHOWN: Mutex<Option<Shown>> = Mutex::new(None);

/// Reserves a command's outputs ([`files::reserve`]). If one of them is standard output, the report goes to standard
/// error.
pub(crate) fn reserve<P: AsRef<Path>, I: Into<PathBuf>>(
    outputs: impl IntoIterator<Item = P>,
    inputs: impl IntoIterator<Item = I>,
) -> Result<Outputs> {
    let (outputs, inputs): (Vec<P>, Vec<PathBuf>) =
        (outputs.into_iter().collect(), inputs.into_iter().map(Into::into).collect());
    let outputs = files::reserve(&outputs.iter().map(AsRef::as_ref).collect::<Vec<_>>(), &inputs)?;
    STDOUT_IS_TAKEN.store(outputs.include_stream(Path::new("/dev/stdout")), Ordering::Relaxed);
    Ok(outputs)
}

/// Prints notes to standard error, apart from the report.
pub(crate) fn note(notes: impl IntoIterator<Item = String>) {
    // A closed standard error is not an error.
    notes.into_iter().for_each(|note| drop(beside_bar(|| writeln!(io::stderr(), "note: {}", printable(&note)))));
}

/// Prints a result. A reader that has closed its end (as `head` does) is not an error.
pub(crate) fn print(text: &str) -> Result<()> {
    let text = printable_lines(text);
    let written = beside_bar(|| match STDOUT_IS_TAKEN.load(Ordering::Relaxed) {
        true => io::stderr().write_all(text.as_bytes()),
        false => io::stdout().write_all(text.as_bytes()),
    });
    match written {
        Err(e) if e.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        other => other.context("cannot write to standard output"),
    }
}

/// Progress in display: by the bar, or else by lines.
struct Shown {
    begun: Instant,
    cadence: Cadence,
    work: Work,
    bar: Option<ProgressBar>,
}

fn shown() -> MutexGuard<'static, Option<Shown>> {
    SHOWN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Writes while the bar is hidden.
fn beside_bar<T>(write: impl FnOnce() -> T) -> T {
    let bar = shown().as_ref().and_then(|shown| shown.bar.clone());
    match bar {
        Some(bar) => bar.suspend(write),
        None => write(),
    }
}

impl Shown {
    fn update(&self) {
        if let Some(bar) = &self.bar {
            bar.set_message(self.work.name.clone());
            bar.set_position((self.work.share.unwrap_or_default() * STEPS as f64) as u64);
        }
    }

    /// Returns the time until the next [`Self::tick`] is due.
    fn wait(&self) -> Duration {
        if self.bar.is_some() { REDRAW } else { self.cadence.wait(self.begun.elapsed()) }
    }

    fn tick(&mut self) {
        if let Some(bar) = &self.bar {
            bar.tick();
        } else if let Some(line) = self.cadence.line(self.begun.elapsed(), &self.work) {
            drop(writeln!(io::stderr(), "{line}"));
        }
    }
}

/// Creates a bar, if standard error is a terminal.
fn bar() -> Result<Option<ProgressBar>> {
    // Within 80 columns: a bar that wraps flickers.
    let style = ProgressStyle::with_template("{msg:30} {bar:30} {percent:>3}%, {eta} left").context("progress bar")?;
    let bar = ProgressBar::new(STEPS).with_style(style);
    Ok((!bar.is_hidden()).then_some(bar))
}

/// Display of progress while the value lives: a bar on a terminal, else a line every 10 s.
pub(crate) struct Progress {
    /// Dropping it ends the thread that redraws between reports.
    _redraw: Option<Sender<()>>,
}

impl Progress {
    /// Begins with the work of this name. Shows nothing if `quiet`.
    pub(crate) fn new(quiet: bool, work: &str) -> Result<Self> {
        if quiet {
            return Ok(Self { _redraw: None });
        }
        let work = Work { name: work.to_owned(), share: None };
        *shown() = Some(Shown { begun: Instant::now(), cadence: Cadence::default(), work, bar: bar()? });
        let (sender, receiver) = channel::<()>();
        thread::spawn(move || {
            loop {
                // A `while let` would hold the lock during the loop's body.
                let Some(wait) = shown().as_ref().map(Shown::wait) else { return };
                if receiver.recv_timeout(wait) != Err(RecvTimeoutError::Timeout) {
                    return;
                }
                shown().iter_mut().for_each(Shown::tick);
            }
        });
        Ok(Self { _redraw: Some(sender) })
    }

    /// Begins work that does not report a share.
    pub(crate) fn begin(&self, work: &str) {
        self.change(|shown| shown.work = Work { name: work.to_owned(), share: None });
    }

    /// Sets the current work and its share done.
    pub(crate) fn set(&self, work: &str, share: f64) {
        self.change(|shown| shown.work = Work { name: work.to_owned(), share: Some(share) });
    }

    /// Sets the name of the current work.
    pub(crate) fn set_work(&self, work: &str) {
        self.change(|shown| work.clone_into(&mut shown.work.name));
    }

    /// Sets the share done.
    pub(crate) fn set_share(&self, share: f64) {
        self.change(|shown| shown.work.share = Some(share));
    }

    /// Removes the bar while `work` writes to the terminal.
    pub(crate) fn without_bar<T>(&self, work: impl FnOnce() -> T) -> T {
        let bar = shown().as_mut().and_then(|shown| shown.bar.take());
        bar.iter().for_each(ProgressBar::finish_and_clear);
        let done = work();
        self.change(|shown| {
            bar.iter().for_each(ProgressBar::reset);
            shown.bar = bar;
        });
        done
    }

    fn change(&self, change: impl FnOnce(&mut Shown)) {
        if let Some(shown) = shown().as_mut() {
            change(shown);
            shown.update();
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        clear();
    }
}

/// Ends the display of progress. Returns `true` if there was a bar.
pub(crate) fn clear() -> bool {
    let bar = shown().take().and_then(|shown| shown.bar);
    bar.iter().for_each(ProgressBar::finish_and_clear);
    bar.is_some()
}
