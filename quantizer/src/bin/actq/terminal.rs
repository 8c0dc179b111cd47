//! What the command shows: results, notes and progress.

use std::io::{self, Write as _};

use actq::text::printable;
use anyhow::{Context as _, Result};
use indicatif::{ProgressBar, ProgressStyle};

/// Notes go to standard error, so that the report stays as it is.
pub(crate) fn note(notes: impl IntoIterator<Item = String>) {
    // That nobody reads them is no error.
    notes.into_iter().for_each(|note| drop(writeln!(io::stderr(), "note: {}", printable(&note))));
}

/// Prints; that a reader has gone away (as `head` does) is no error.
pub(crate) fn print(text: &str) -> Result<()> {
    let lines: Vec<_> = text.split('\n').map(printable).collect();
    match io::stdout().write_all(lines.join("\n").as_bytes()) {
        Err(e) if e.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        other => other.context("standard output cannot be written"),
    }
}

/// Steps of the progress bar; the work reports the share done.
const PROGRESS: u64 = 1000;

pub(crate) fn progress_bar() -> Result<ProgressBar> {
    // Within 80 columns: a bar that wraps flickers.
    let style = ProgressStyle::with_template("{msg:30} {bar:30} {percent:>3}%, {eta} left").context("progress bar")?;
    Ok(ProgressBar::new(PROGRESS).with_style(style))
}

pub(crate) fn set_share(bar: &ProgressBar, share: f64) {
    bar.set_position((share * PROGRESS as f64) as u64);
}
