//! The shared policies, which do not stand in the repository, and what is skipped without them.

use std::fs::File;
use std::io::{Write as _, stderr};
use std::panic::Location;
use std::path::PathBuf;

/// The folder of shared policies, where `ACTQ_SHARED` names it. Where it does not, what would run on them is skipped,
/// which is said on standard error, past the capture of tests, and in the file that `ACTQ_SKIPPED` names, for
/// `cargo verify` to count.
#[track_caller]
pub fn shared_policies() -> Option<PathBuf> {
    match std::env::var_os("ACTQ_SHARED") {
        Some(folder) if !folder.is_empty() => Some(PathBuf::from(folder).join("policies")),
        _ => {
            skip(Location::caller(), "ACTQ_SHARED is not set");
            None
        }
    }
}

/// Says that a test, or a part of one, is skipped, as [`shared_policies`] does.
#[track_caller]
pub fn skipped(why: &str) {
    skip(Location::caller(), why);
}

fn skip(place: &Location<'_>, why: &str) {
    // The test harness names a test's thread after it, unless it runs all tests on one.
    let name = std::thread::current().name().filter(|name| *name != "main").map(str::to_owned);
    let name = name.unwrap_or_else(|| format!("{}:{}", place.file(), place.line()));
    let line = format!("SKIPPED {name}: {why}\n");
    // `eprintln!` would be captured. Where even this cannot be written, nobody can be told.
    let _ = stderr().write_all(line.as_bytes());
    if let Some(path) = std::env::var_os("ACTQ_SKIPPED") {
        let _ =
            File::options().create(true).append(true).open(path).and_then(|mut file| file.write_all(line.as_bytes()));
    }
}
