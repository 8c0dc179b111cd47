//! The control tick's times.

use core::num::NonZeroU64;

use actq_link::report;

/// When the tick began and how long it took, in cycles of a timer that counts down from `period` - 1 and makes the tick
/// at its end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Timing {
    /// Ticks, modulo 2^32.
    pub ticks: u32,
    /// Cycles of the longest tick.
    pub worst: u32,
    /// Cycles from the timer's end to the tick that came latest.
    pub latest: u32,
    /// Ticks that were longer than a period, modulo 2^32: the timer had ended again.
    pub overruns: u32,
}

impl Timing {
    /// Notes a tick: the timer's count when it began and when it ended, and whether the timer has ended in between.
    pub fn note(&mut self, period: u32, began: u32, ended: u32, overrun: bool) {
        let late = period.saturating_sub(1).saturating_sub(began);
        self.latest = self.latest.max(late);
        self.worst = self.worst.max(if overrun { period } else { began.saturating_sub(ended) });
        self.overruns = self.overruns.wrapping_add(overrun.into());
        self.ticks = self.ticks.wrapping_add(1);
    }
}

/// How fast the clock and the tick are.
#[derive(Clone, Copy, Debug)]
pub struct Rates {
    /// Cycles of the clock in a second.
    clock: NonZeroU64,
    /// Ticks in a second.
    tick: NonZeroU64,
}

impl Rates {
    /// `clock` cycles and `tick` ticks in a second; 0 is taken as 1.
    pub fn new(clock: u32, tick: u32) -> Self {
        let rate = |rate: u32| NonZeroU64::new(rate.into()).unwrap_or(NonZeroU64::MIN);
        Self { clock: rate(clock), tick: rate(tick) }
    }

    /// Time of a tick in µs; wraps. Its resolution is the tick. (A tick is a whole number of them.)
    pub fn micros(&self, ticks: u32) -> u32 {
        ticks.wrapping_mul((1_000_000 / self.tick) as u32)
    }

    /// The times as the link tells them; `worst_head` in µs, `stack` in bytes.
    pub fn report(&self, timing: &Timing, worst_head: u32, stack: u32) -> report::Timing {
        let nanos = |cycles: u32| (u64::from(cycles) * 1_000_000_000 / self.clock) as u32;
        report::Timing {
            period: (1_000_000_000 / self.tick) as u32,
            worst_tick: nanos(timing.worst),
            worst_jitter: nanos(timing.latest),
            worst_head,
            overruns: timing.overruns,
            stack,
        }
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
        assert_eq!(timing, Timing { ticks: 3, worst: 50, latest: 19, overruns: 0 });
        let rates = Rates::new(25_000_000, 8000);
        let told = rates.report(&timing, 7, 9);
        assert_eq!((told.period, told.worst_tick, told.worst_jitter), (125_000, 2000, 760));
        assert_eq!((told.worst_head, told.overruns, told.stack), (7, 0, 9));
        assert_eq!((rates.micros(3), rates.micros(u32::MAX)), (375, 0u32.wrapping_sub(125)));
        timing.note(1000, 990, 995, true);
        assert_eq!((timing.worst, timing.overruns), (1000, 1));
    }
}
