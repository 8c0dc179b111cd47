//! Locks that show which folders recorders write to. Each recorder holds a shared lock on its folder; the system
//! releases it when the process ends. A simulator may end before its policy's process has written the last episode.

use std::fs::File;
use std::path::Path;
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Takes a shared lock on the folder while the value lives; `None` if the system cannot lock folders.
pub(super) fn share(folder: &Path) -> Option<File> {
    let folder = File::open(folder).ok()?;
    folder.lock_shared().ok()?;
    Some(folder)
}

/// Waits until no recorder writes to `folder`, at most for `timeout`. Returns `false` if one still does.
pub(crate) fn wait_for_recorders(folder: &Path, timeout: Duration) -> bool {
    let Ok(folder) = File::open(folder) else { return true };
    let started = Instant::now();
    loop {
        match folder.try_lock() {
            Err(std::fs::TryLockError::WouldBlock) if started.elapsed() >= timeout => return false,
            Err(std::fs::TryLockError::WouldBlock) => sleep(Duration::from_millis(20)),
            _ => return true,
        }
    }
}
