//! The shared policies, which are not in the repository, and the report of skipped tests.

use std::fs::File;
use std::io::{Write as _, stderr};
use std::panic::Location;
use std::path::PathBuf;

/// Returns the folder of shared policies if `ACTQ_SHARED` names it. Otherwise reports the caller as skipped on standard
/// error, past the capture of tests, and in the file that `ACTQ_SKIPPED` names, which `cargo verify` counts.
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

/// Reports a test, or a part of one, as skipped, like [`shared_policies`].
#[track_caller]
pub fn skipped(why: &str) {
    skip(Location::caller(), why);
}

fn skip(place: &Location<'_>, why: &str) {
    // The test harness names a test's thread after it, unless all tests run on one thread.
    let name = std::thread::current().name().filter(|name| *name != "main").map(str::to_owned);
    let name = name.unwrap_or_else(|| format!("{}:{}", place.file(), place.line()));
    let line = format!("SKIPPED {name}: {why}\n");
    // `eprintln!` would be captured. If this fails, no one can be informed.
    let _ = stderr().write_all(line.as_bytes());
    if let Some(path) = std::env::var_os("ACTQ_SKIPPED") {
        let _ =
            File::options().create(true).append(true).open(path).and_then(|mut file| file.write_all(line.as_bytes()));
    }
}
