//! Who is recording into a folder: as long as a recorder runs it shares a lock of the folder, which falls with its
//! process however it ends. A simulator may be gone before the policy that it drove has written its last episode.

use std::fs::File;
use std::path::Path;
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Shares the folder's lock while the value lives; `None` where folders have no locks.
pub(super) fn share(folder: &Path) -> Option<File> {
    let folder = File::open(folder).ok()?;
    folder.lock_shared().ok()?;
    Some(folder)
}

/// Waits until nobody records into `folder` any more, at most for `patience`; whether it is so.
pub(crate) fn wait_for_recorders(folder: &Path, patience: Duration) -> bool {
    let Ok(folder) = File::open(folder) else { return true };
    let started = Instant::now();
    loop {
        match folder.try_lock() {
            Err(std::fs::TryLockError::WouldBlock) if started.elapsed() >= patience => return false,
            Err(std::fs::TryLockError::WouldBlock) => sleep(Duration::from_millis(20)),
            _ => return true,
        }
    }
}
