//! The file of all results, from which an interrupted run resumes.

use std::fs::{self, File};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{SystemTime, UNIX_EPOCH};

use actq_bench::root;
use anyhow::{Context as _, Result, bail, ensure};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::cell::{Cell, CellKey};
use super::plan::Plan;

const FORMAT: &str = "actq-compare-1";

/// The first line: the origin of the results.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Header {
    /// The version of the file format.
    pub format: String,
    /// The commit of the sources.
    pub commit: String,
    /// `true` if the sources differed from it.
    pub dirty: bool,
    /// Begin of the run, UTC.
    pub date: String,
    /// The plan.
    pub options: Value,
}

impl Header {
    pub(super) fn now(plan: &Plan) -> Result<Self> {
        let git = |arguments: &[&str]| -> Option<String> {
            let output = Command::new("git").current_dir(root()).args(arguments).output().ok()?;
            output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
        };
        // Outside a repository, for example in an unpacked archive, nothing is known.
        let commit = git(&["rev-parse", "HEAD"]).unwrap_or_else(|| "unknown".to_owned());
        // Ignore files that git does not track: the results may be among them.
        let changes = git(&["--no-optional-locks", "status", "--porcelain", "--untracked-files=no"]);
        let dirty = changes.is_none_or(|changes| !changes.is_empty());
        let seconds = SystemTime::now().duration_since(UNIX_EPOCH).context("the clock is before 1970")?.as_secs();
        let options = serde_json::to_value(plan)?;
        Ok(Self { format: FORMAT.to_owned(), commit, dirty, date: date(seconds), options })
    }

    /// Returns `true` if results of both runs are comparable.
    fn same_run(&self, other: &Self) -> bool {
        (&self.format, &self.commit, self.dirty, &self.options)
            == (&other.format, &other.commit, other.dirty, &other.options)
    }
}

/// Formats a date and time (UTC) from seconds since 1970: days from the civil calendar's 400-year cycles.
fn date(seconds: u64) -> String {
    let days = seconds / 86_400 + 719_468;
    let (era, day_of_era) = (days / 146_097, days % 146_097);
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    // Years that begin in March, so that the leap day is the last.
    let month = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month + 2) / 5 + 1;
    let month = if month < 10 { month + 3 } else { month - 9 };
    let year = year_of_era + 400 * era + u64::from(month <= 2);
    let (hour, minute) = (seconds / 3600 % 24, seconds / 60 % 60);
    format!("{year:04}-{month:02}-{day:02} {hour:02}:{minute:02}")
}

/// The results so far, and the place of the next ones.
#[derive(Debug)]
pub struct Journal {
    /// The first line.
    pub header: Header,
    /// The results.
    pub cells: Vec<Cell>,
    path: PathBuf,
}

impl Journal {
    /// Returns the file in the folder of a run.
    fn path(folder: &Path) -> PathBuf {
        folder.join("compare.jsonl")
    }

    /// Begins a run, or resumes one with the same plan and sources.
    pub(super) fn open(plan: &Plan) -> Result<Self> {
        let header = Header::now(plan)?;
        let path = Self::path(&plan.out);
        fs::create_dir_all(&plan.out).with_context(|| format!("cannot create {}", plan.out.display()))?;
        if !path.exists() {
            let journal = Self { header, cells: Vec::new(), path };
            fs::write(&journal.path, line(&journal.header)?).with_context(|| journal.failed("written"))?;
            return Ok(journal);
        }
        let journal = Self::read(&plan.out)?;
        ensure!(
            journal.header.same_run(&header),
            "{}: holds results of other sources or options (commit {}{}, {}); name another folder with --out, or give the same \
             options at that commit",
            journal.path.display(),
            journal.header.commit,
            if journal.header.dirty { " with changes" } else { "" },
            journal.header.options
        );
        // An interrupted run may leave a truncated line, which would swallow the next one.
        let whole = fs::read(&journal.path)?.iter().rposition(|byte| *byte == b'\n').map_or(0, |end| end + 1);
        let cut = || File::options().write(true).open(&journal.path)?.set_len(whole as u64);
        cut().with_context(|| journal.failed("written"))?;
        Ok(journal)
    }

    /// Reads the results of a run.
    pub fn read(folder: &Path) -> Result<Self> {
        let path = Self::path(folder);
        let bytes = fs::read(&path)
            .with_context(|| format!("cannot read {}; has a comparison begun there?", path.display()))?;
        let text = String::from_utf8_lossy(&bytes);
        let whole = text.rfind('\n').map_or("", |end| &text[..end]);
        let mut lines = whole.lines().enumerate();
        let wrong = |number: usize| format!("{}, line {}: not a line of a comparison", path.display(), number + 1);
        let Some((number, first)) = lines.next() else { bail!("{}: is empty; remove it", path.display()) };
        let header: Header = serde_json::from_str(first).with_context(|| wrong(number))?;
        ensure!(header.format == FORMAT, "{}: unknown format {}; expected {FORMAT}", path.display(), header.format);
        let cells = lines
            .map(|(number, line)| serde_json::from_str(line).with_context(|| wrong(number)))
            .collect::<Result<Vec<Cell>>>()?;
        Ok(Self { header, cells, path })
    }

    /// Returns a result: the latest, if there are several.
    pub fn find(&self, key: &CellKey) -> Option<&Cell> {
        self.cells.iter().rev().find(|cell| cell.key == *key)
    }

    /// Appends a result.
    pub(super) fn add(&mut self, cell: Cell) -> Result<()> {
        let append = || -> Result<()> {
            let mut file = File::options().append(true).open(&self.path)?;
            file.write_all(line(&cell)?.as_bytes())?;
            Ok(file.sync_data()?)
        };
        append().with_context(|| self.failed("written"))?;
        self.cells.push(cell);
        Ok(())
    }

    fn failed(&self, what: &str) -> String {
        format!("{}: cannot be {what}", self.path.display())
    }
}

fn line(value: &impl Serialize) -> Result<String> {
    Ok(serde_json::to_string(value)? + "\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_those_of_the_calendar() {
        for (seconds, text) in [
            (0, "1970-01-01 00:00"),
            (951_782_399, "2000-02-28 23:59"),
            (951_782_400, "2000-02-29 00:00"),
            (1_798_761_599, "2026-12-31 23:59"),
        ] {
            assert_eq!(date(seconds), text);
        }
    }
}
