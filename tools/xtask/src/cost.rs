//! Wall time and CPU time of the processes that this one starts.

use std::fs;
use std::time::{Duration, Instant};

/// Clock ticks per second in Linux's /proc, on every architecture with a Rust host compiler.
const TICKS: u64 = 100;

/// Time since a moment.
pub(crate) struct Clock {
    start: Instant,
    cpu: Option<Duration>,
}

impl Clock {
    pub(crate) fn start() -> Self {
        Self { start: Instant::now(), cpu: cpu_of_children() }
    }

    pub(crate) fn cost(&self) -> Cost {
        let cpu = cpu_of_children().zip(self.cpu).map(|(now, then)| now.saturating_sub(then));
        Cost { wall: self.start.elapsed(), cpu }
    }
}

/// Wall time, and CPU time on systems that report it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cost {
    pub(crate) wall: Duration,
    pub(crate) cpu: Option<Duration>,
}

/// Returns the user and system time of all ended child processes, and of their children; `None` without a /proc.
fn cpu_of_children() -> Option<Duration> {
    ticks(&fs::read_to_string("/proc/self/stat").ok()?).map(|ticks| Duration::from_millis(1000 / TICKS * ticks))
}

/// Parses fields 16 and 17 of `/proc/self/stat` (proc(5): cutime, cstime). The second field is a name in parentheses,
/// with any content.
fn ticks(stat: &str) -> Option<u64> {
    let (_, fields) = stat.rsplit_once(')')?;
    let mut fields = fields.split_whitespace().skip(13);
    let mut next = || fields.next()?.parse::<u64>().ok();
    Some(next()? + next()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_counted_after_the_process_name() {
        let stat = "12 (a) 9 9 b) S 3 4 5 6 7 8 9 10 11 12 13 14 250 17 18 19 20";
        assert_eq!(ticks(stat), Some(250 + 17));
        assert_eq!(ticks("12 (a) S 3"), None);
    }
}
