//! The results of a comparison, from the store of its jobs.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};
use std::{fs, process};

use actq_bench::root;
use actq_cli::commands::jobs::host::Command;
use actq_jobs::order;
use actq_jobs::record::Outcome;
use actq_jobs::store::Store;
use anyhow::{Context as _, Result, bail, ensure};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::cell::{Attempted, Cell, CellKey};
use super::jobs::{CellJobs, cells as cells_of};
use super::plan::Plan;

const FORMAT: &str = "actq-compare-2";

/// Files of a run's folder: the origin, the jobs, their results, and their seconds.
pub(super) const HEADER: &str = "compare.json";
pub(super) const PLAN: &str = "plan.jsonl";
pub(super) const STORE: &str = "store";
pub(super) const LOG: &str = "log.jsonl";

/// The origin of the results.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Header {
    /// The version of the file format.
    pub format: String,
    /// The commits of the sources that have worked on the results, in order.
    pub commits: Vec<String>,
    /// Begin of the first run, UTC.
    pub date: String,
    /// The plan.
    pub options: Value,
}

impl Header {
    /// Returns the origin of a run with this plan and these sources, after earlier ones in its folder.
    pub(super) fn now(plan: &Plan) -> Result<Self> {
        let git = |arguments: &[&str]| -> Option<String> {
            let output = process::Command::new("git").current_dir(root()).args(arguments).output().ok()?;
            output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
        };
        // Outside a repository, for example in an unpacked archive, nothing is known.
        let mut commit = git(&["rev-parse", "HEAD"]).unwrap_or_else(|| "unknown".to_owned());
        // Ignore files that git does not track: the results may be among them.
        let changes = git(&["--no-optional-locks", "status", "--porcelain", "--untracked-files=no"]);
        if changes.is_none_or(|changes| !changes.is_empty()) {
            commit += " with changes that are not in it";
        }
        let options = serde_json::to_value(plan)?;
        let mut header = match Self::read(&plan.out)? {
            Some(earlier) => Self { options, ..earlier },
            None => {
                let since = SystemTime::now().duration_since(UNIX_EPOCH).context("the clock is before 1970")?;
                Self { format: FORMAT.to_owned(), commits: Vec::new(), date: date(since.as_secs()), options }
            }
        };
        header.commits.retain(|known| *known != commit);
        header.commits.push(commit);
        Ok(header)
    }

    /// Reads the origin of the results in a folder, if there is one.
    fn read(folder: &Path) -> Result<Option<Self>> {
        let path = folder.join(HEADER);
        if !path.exists() {
            return Ok(None);
        }
        let text = fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?;
        let wrong = || format!("{}: is not that of a comparison; name another folder with --out", path.display());
        let header: Self = serde_json::from_slice(&text).with_context(wrong)?;
        ensure!(header.format == FORMAT, "{}: unknown format {}; expected {FORMAT}", path.display(), header.format);
        Ok(Some(header))
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

/// The results so far.
#[derive(Debug)]
pub struct Results {
    /// The origin of the results.
    pub header: Header,
    /// The results.
    pub cells: Vec<Cell>,
}

impl Results {
    /// Reads the results of a run.
    ///
    /// # Errors
    ///
    /// If no comparison has begun there, or a file is damaged.
    pub fn read(folder: &Path) -> Result<Self> {
        let read = |path: &Path| {
            fs::read_to_string(path)
                .with_context(|| format!("cannot read {}; has a comparison begun there?", path.display()))
        };
        let Some(header) = Header::read(folder)? else {
            bail!("{} has no {HEADER}; has a comparison begun there?", folder.display())
        };
        let jobs = order::read(&read(&folder.join(PLAN))?)?;
        let store = Store::open(&folder.join(STORE), &Command)?;
        let seconds = seconds(&fs::read_to_string(folder.join(LOG)).unwrap_or_default());
        let mut cells = Vec::new();
        for (key, CellJobs { make, drive }) in cells_of(&jobs)? {
            let read = |address: &Option<String>| -> Result<Option<Value>> {
                let Some(address) = address.as_ref().filter(|address| store.has(address)) else { return Ok(None) };
                match store.read(address)? {
                    Outcome::Custom(found) => Ok(Some(found.value)),
                    _ => bail!("{address}: the result is not one of a comparison"),
                }
            };
            let attempted: Option<Attempted> = read(&make)?.map(serde_json::from_value).transpose()?;
            if make.is_some() && attempted.is_none() {
                continue;
            }
            let (made, why) = attempted.map_or((None, None), |attempted| (attempted.made, attempted.why));
            let driven = read(&drive)?.filter(|value| !value.is_null());
            let seconds = make.and_then(|address| seconds.get(&address).copied());
            if made.is_some() || why.is_some() || driven.is_some() {
                cells.push(Cell { key, made, why, driven, seconds });
            }
        }
        Ok(Self { header, cells })
    }

    /// Returns a result.
    pub fn find(&self, key: &CellKey) -> Option<&Cell> {
        self.cells.iter().find(|cell| cell.key == *key)
    }
}

/// Returns the seconds of the jobs that a log has, by their addresses; of several runs, those of the last.
fn seconds(log: &str) -> BTreeMap<String, f64> {
    let entry = |line: &str| {
        let line: Value = serde_json::from_str(line).ok()?;
        let is_done = line.get("status")? == 0;
        Some((line.get("address")?.as_str()?.to_owned(), line.get("seconds")?.as_f64()?)).filter(|_| is_done)
    };
    log.lines().filter_map(entry).collect()
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
