//! Times of the control tick.

use core::num::NonZeroU32;

use actq_link::report;

/// Statistics of the control tick, in cycles of a timer that counts down from `period` - 1 and triggers the tick at its
/// end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Timing {
    /// Number of ticks, modulo 2^32.
    pub ticks: u32,
    /// Duration of the longest tick, in cycles.
    pub worst_tick: u32,
    /// Longest delay from the timer's end to the tick's start, in cycles.
    pub worst_delay: u32,
    /// Ticks longer than a period, modulo 2^32: the timer ended again.
    pub overruns: u32,
}

impl Timing {
    /// Records a tick: the timer's count at its begin and end, and `overrun` if the timer ended in between.
    pub fn record(&mut self, period: u32, began: u32, ended: u32, overrun: bool) {
        let late = period.saturating_sub(1).saturating_sub(began);
        self.worst_delay = self.worst_delay.max(late);
        self.worst_tick = self.worst_tick.max(if overrun { period } else { began.saturating_sub(ended) });
        self.overruns = self.overruns.wrapping_add(overrun.into());
        self.ticks = self.ticks.wrapping_add(1);
    }
}

/// Rates of the clock and the tick.
#[derive(Clone, Copy, Debug)]
pub struct Rates {
    /// Clock cycles per second.
    clock: NonZeroU32,
    /// Ticks per second.
    tick: NonZeroU32,
}

impl Rates {
    /// Creates rates of `clock` cycles, less than 2^29, and `tick` ticks per second; 0 counts as 1.
    pub fn new(clock: u32, tick: u32) -> Self {
        let rate = |rate: u32| NonZeroU32::new(rate).unwrap_or(NonZeroU32::MIN);
        Self { clock: rate(clock), tick: rate(tick) }
    }

    /// Returns the time of a tick in µs; wraps. The resolution is a tick, which is a whole number of µs.
    pub fn micros(&self, ticks: u32) -> u32 {
        ticks.wrapping_mul(1_000_000 / self.tick)
    }

    /// Returns the link's report of the times; `worst_head` in µs, `stack` in bytes.
    pub fn report(&self, timing: &Timing, worst_head: u32, stack: u32) -> report::Timing {
        report::Timing {
            period: 1_000_000_000 / self.tick,
            worst_tick: self.nanos(timing.worst_tick),
            worst_jitter: self.nanos(timing.worst_delay),
            worst_head,
            overruns: timing.overruns,
            stack,
        }
    }

    /// Returns the time of `cycles` in ns, rounded down; wraps. Long division: of 64 bits it would be a kilobyte of code.
    fn nanos(&self, cycles: u32) -> u32 {
        let (mut nanos, mut rest) = (cycles / self.clock, cycles % self.clock);
        // 10^9
        for factor in [8, 8, 8, 5, 5, 5, 5, 5, 5, 5, 5, 5] {
            rest = rest.wrapping_mul(factor);
            nanos = nanos.wrapping_mul(factor).wrapping_add(rest / self.clock);
            rest %= self.clock;
        }
        nanos
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_follow_from_a_timer_that_counts_down() {
        let mut timing = Timing::default();
        timing.record(1000, 990, 940, false);
        timing.record(1000, 980, 950, false);
        timing.record(1000, 995, 985, false);
        assert_eq!(timing, Timing { ticks: 3, worst_tick: 50, worst_delay: 19, overruns: 0 });
        let rates = Rates::new(25_000_000, 8000);
        let report = rates.report(&timing, 7, 9);
        assert_eq!((report.period, report.worst_tick, report.worst_jitter), (125_000, 2000, 760));
        assert_eq!((report.worst_head, report.overruns, report.stack), (7, 0, 9));
        assert_eq!((rates.micros(3), rates.micros(u32::MAX)), (375, 0u32.wrapping_sub(125)));
        for clock in [1, 999, 64_000_000, 168_000_000, 480_000_000, (1 << 29) - 1] {
            for cycles in [0, 1, 999, 1_234_567, 400_000_001] {
                let exact = u64::from(cycles) * 1_000_000_000 / u64::from(clock);
                assert_eq!(Rates::new(clock, 1).nanos(cycles), exact as u32, "{cycles} cycles at {clock} Hz");
            }
        }
        timing.record(1000, 990, 995, true);
        assert_eq!((timing.worst_tick, timing.overruns), (1000, 1));
    }
}
