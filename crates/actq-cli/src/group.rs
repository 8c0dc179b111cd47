//! The process groups of the commands that this process runs, as that of `--drive`. The processes of a group end
//! together.

use std::collections::BTreeSet;
use std::io;
use std::process::{Child, Command, ExitStatus};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Time after a signal at which the group is killed. A robot's driver may need seconds to stop the robot.
#[cfg(unix)]
const END_TIMEOUT: std::time::Duration = std::time::Duration::from_secs(10);

/// Process ids of the leaders of the running groups.
static LEADERS: Mutex<BTreeSet<u32>> = Mutex::new(BTreeSet::new());

fn leaders() -> MutexGuard<'static, BTreeSet<u32>> {
    LEADERS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Starts a command in a new process group.
pub(crate) fn spawn(command: &mut Command) -> io::Result<Child> {
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(command, 0);
    let mut leaders = leaders();
    let child = command.spawn()?;
    leaders.insert(child.id());
    Ok(child)
}

/// Waits until the group's leader ends.
pub(crate) fn wait(mut child: Child) -> io::Result<ExitStatus> {
    let status = child.wait();
    leaders().remove(&child.id());
    status
}

/// Passes a signal to the running groups, if any. Kills those that run after [`END_TIMEOUT`], or as soon as `kill_now`
/// returns `true`. No group can start after that.
#[cfg(unix)]
pub(crate) fn stop(signal: i32, mut kill_now: impl FnMut() -> bool) {
    use rustix::process::{Pid, Signal, kill_process_group, test_kill_process_group};
    let leaders = std::mem::ManuallyDrop::new(leaders());
    let groups: Vec<Pid> = leaders.iter().filter_map(|leader| Pid::from_raw(leader.cast_signed())).collect();
    let Some(signal) = Signal::from_named_raw(signal) else { return };
    let begun = std::time::Instant::now();
    // A group may already have ended.
    let signal_all = |signal| groups.iter().for_each(|group| kill_process_group(*group, signal).unwrap_or_default());
    signal_all(signal);
    let runs = |group: &Pid| test_kill_process_group(*group).is_ok();
    while groups.iter().any(runs) && begun.elapsed() < END_TIMEOUT && !kill_now() {
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    signal_all(Signal::KILL);
}
