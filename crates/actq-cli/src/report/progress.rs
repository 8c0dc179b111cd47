//! Progress lines of long work, for a log or a pipe.

use std::time::Duration;

use actq::text::printable;

/// Time between two lines.
const INTERVAL: Duration = Duration::from_secs(10);

/// The current work.
#[derive(Clone, Debug, Default)]
pub struct Work {
    /// Its name.
    pub name: String,
    /// Its share done, if known.
    pub share: Option<f64>,
}

/// Schedule of the progress lines. All times count from the start of the work, by the caller's clock.
#[derive(Debug, Default)]
pub struct Cadence {
    last_line: Duration,
}

impl Cadence {
    /// Returns the time until the next line is due.
    pub fn wait(&self, now: Duration) -> Duration {
        (self.last_line + INTERVAL).saturating_sub(now)
    }

    /// Returns the line about `work`, if one is due.
    pub fn line(&mut self, now: Duration, work: &Work) -> Option<String> {
        self.wait(now).is_zero().then(|| {
            self.last_line = now;
            let share = work.share.map_or(String::new(), |share| format!(", {:.0}%", 100.0 * share));
            format!("progress: {} s{share}: {}", now.as_secs(), printable(&work.name))
        })
    }
}

/// Formats a remaining time, in seconds.
pub fn duration(seconds: f64) -> String {
    match seconds {
        ..90.0 => format!("{seconds:.0} s"),
        ..5400.0 => format!("{:.0} min", seconds / 60.0),
        _ => format!("{:.1} h", seconds / 3600.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(seconds: f64) -> Duration {
        Duration::from_secs_f64(seconds)
    }

    #[test]
    fn a_line_is_due_every_ten_seconds() {
        let (mut cadence, work) = (Cadence::default(), Work { name: "learning".to_owned(), share: Some(0.346) });
        let mut line = |seconds: f64| cadence.line(after(seconds), &work);
        assert_eq!([line(0.0), line(9.9)], [None, None]);
        assert_eq!(line(10.0).as_deref(), Some("progress: 10 s, 35%: learning"));
        assert_eq!([line(10.1), line(19.9)], [None, None]);
        // After a late line, the next one is due 10 s later.
        assert_eq!(line(47.5).as_deref(), Some("progress: 47 s, 35%: learning"));
        assert_eq!([line(50.0), line(57.4)], [None, None]);
        assert!(line(57.5).is_some());
    }

    #[test]
    fn durations_have_one_unit() {
        assert_eq!([80.0, 600.0, 9000.0].map(duration), ["80 s", "10 min", "2.5 h"]);
    }

    #[test]
    fn waits_end_when_lines_are_due() {
        let (mut cadence, work) = (Cadence::default(), Work { name: "a\x1b".to_owned(), share: None });
        let mut now = Duration::ZERO;
        for lines in 1..=5 {
            now += cadence.wait(now);
            assert_eq!(now, lines * INTERVAL);
            assert_eq!(cadence.line(now, &work), Some(format!("progress: {}0 s: a\\u{{1b}}", lines)));
        }
    }
}
