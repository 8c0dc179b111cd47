//! The process group of the `--drive` command. Its processes end together.

use std::io;
use std::process::{Child, Command, ExitStatus};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Time after a signal at which the group is killed.
#[cfg(unix)]
const END_TIMEOUT: std::time::Duration = std::time::Duration::from_secs(2);

/// Process id of the leader of the running group.
static LEADER: Mutex<Option<u32>> = Mutex::new(None);

fn leader() -> MutexGuard<'static, Option<u32>> {
    LEADER.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Starts a command in a new process group.
pub(crate) fn spawn(command: &mut Command) -> io::Result<Child> {
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(command, 0);
    let mut leader = leader();
    let child = command.spawn()?;
    *leader = Some(child.id());
    Ok(child)
}

/// Waits until the group's leader ends.
pub(crate) fn wait(mut child: Child) -> io::Result<ExitStatus> {
    let status = child.wait();
    *leader() = None;
    status
}

/// Passes a signal to the running group, if any, and kills it after [`END_TIMEOUT`]. No group can start after that.
#[cfg(unix)]
pub(crate) fn stop(signal: i32) {
    use rustix::process::{Pid, Signal, kill_process_group, test_kill_process_group};
    let leader = std::mem::ManuallyDrop::new(leader());
    let group = leader.and_then(|leader| Pid::from_raw(leader.cast_signed()));
    let Some((group, signal)) = group.zip(Signal::from_named_raw(signal)) else { return };
    let begun = std::time::Instant::now();
    // The group may already have ended.
    let _ = kill_process_group(group, signal);
    while test_kill_process_group(group).is_ok() && begun.elapsed() < END_TIMEOUT {
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    let _ = kill_process_group(group, Signal::KILL);
}
