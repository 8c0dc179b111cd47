//! CPU time of the processes that this one started.

use std::fs;
use std::time::Duration;

/// Ticks of a second in Linux's /proc, on all of its architectures that Rust is at home on.
const TICKS: u64 = 100;

/// User and system time of all processes that were started and have ended, and of those that they started; `None` where
/// there is no /proc.
pub(crate) fn of_children() -> Option<Duration> {
    ticks(&fs::read_to_string("/proc/self/stat").ok()?).map(|ticks| Duration::from_millis(1000 / TICKS * ticks))
}

/// Fields 16 and 17 of `/proc/self/stat` (proc(5): cutime, cstime). The second field is a name in parentheses, which
/// may hold anything.
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
    fn the_fields_are_those_behind_the_name() {
        let stat = "12 (a) 9 9 b) S 3 4 5 6 7 8 9 10 11 12 13 14 250 17 18 19 20";
        assert_eq!(ticks(stat), Some(250 + 17));
        assert_eq!(ticks("12 (a) S 3"), None);
    }
}
