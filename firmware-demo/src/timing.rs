//! The control tick's times.

/// When the tick began and how long it took, in cycles of a timer that counts down from `period` - 1 and makes the tick at its end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Timing {
    /// Ticks, modulo 2^32.
    pub ticks: u32,
    /// Cycles of the longest tick.
    pub worst: u32,
    /// Cycles from the timer's end to the tick that came soonest, and to the one that came latest: their difference is the jitter.
    pub soonest: u32,
    /// See [`Timing::soonest`].
    pub latest: u32,
    /// Ticks that were longer than a period, modulo 2^32: the timer had ended again.
    pub overruns: u32,
}

impl Timing {
    /// Notes a tick: the timer's count when it began and when it ended, and whether the timer has ended in between.
    pub fn note(&mut self, period: u32, began: u32, ended: u32, overrun: bool) {
        let late = period.saturating_sub(1).saturating_sub(began);
        let first = self.ticks == 0;
        self.soonest = if first { late } else { self.soonest.min(late) };
        self.latest = self.latest.max(late);
        self.worst = self.worst.max(if overrun { period } else { began.saturating_sub(ended) });
        self.overruns = self.overruns.wrapping_add(overrun.into());
        self.ticks = self.ticks.wrapping_add(1);
    }

    /// Cycles by which the begin of ticks varies.
    pub fn jitter(&self) -> u32 {
        self.latest.saturating_sub(self.soonest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_times_are_those_of_a_timer_that_counts_down() {
        let mut timing = Timing::default();
        timing.note(1000, 990, 940, false);
        timing.note(1000, 980, 950, false);
        timing.note(1000, 995, 985, false);
        assert_eq!(timing, Timing { ticks: 3, worst: 50, soonest: 4, latest: 19, overruns: 0 });
        assert_eq!(timing.jitter(), 15);
        timing.note(1000, 990, 995, true);
        assert_eq!((timing.worst, timing.overruns), (1000, 1));
    }
}
