//! The processes of a command that is run for the user: one group, so that they end together.

use std::io;
use std::process::{Child, Command, ExitStatus};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// How long the group may take to end after a signal; then it is killed.
#[cfg(unix)]
const ALLOWANCE: std::time::Duration = std::time::Duration::from_secs(2);

/// The first process of the group that is running.
static LEADER: Mutex<Option<u32>> = Mutex::new(None);

fn leader() -> MutexGuard<'static, Option<u32>> {
    LEADER.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Starts a command as a group of its own.
pub(crate) fn spawn(command: &mut Command) -> io::Result<Child> {
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(command, 0);
    let mut leader = leader();
    let child = command.spawn()?;
    *leader = Some(child.id());
    Ok(child)
}

/// Waits for the end of the group's first process.
pub(crate) fn wait(mut child: Child) -> io::Result<ExitStatus> {
    let status = child.wait();
    *leader() = None;
    status
}

/// Passes a signal to the group if one is running, and ends it. No other can start after that.
#[cfg(unix)]
pub(crate) fn stop(signal: i32) {
    use rustix::process::{Pid, Signal, kill_process_group, test_kill_process_group};
    let leader = std::mem::ManuallyDrop::new(leader());
    let group = leader.and_then(|leader| Pid::from_raw(leader.cast_signed()));
    let Some((group, signal)) = group.zip(Signal::from_named_raw(signal)) else { return };
    let begun = std::time::Instant::now();
    // A group that has ended already is no error.
    let _ = kill_process_group(group, signal);
    while test_kill_process_group(group).is_ok() && begun.elapsed() < ALLOWANCE {
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    let _ = kill_process_group(group, Signal::KILL);
}
