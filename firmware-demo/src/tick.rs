//! The control tick: its times, and what it does until a controller stands behind it.

use actq_boards::seams::Stage;

use crate::application::Control;

/// Values of an action that the tick takes at most.
pub const MAX_ACTION: usize = 64;

/// The last action, on its way from the loop to the tick.
#[derive(Clone, Copy, Debug)]
pub struct Output {
    values: [f32; MAX_ACTION],
    len: usize,
}

impl Output {
    /// No action yet.
    pub const NONE: Self = Self { values: [0.0; MAX_ACTION], len: 0 };

    /// Takes an action. One that is longer than [`MAX_ACTION`] counts as none.
    pub fn set(&mut self, action: &[f32]) {
        self.len = 0;
        if let Some(values) = self.values.get_mut(..action.len()) {
            values.copy_from_slice(action);
            self.len = action.len();
        }
    }

    /// The last action.
    pub fn get(&self) -> Option<&[f32]> {
        self.values.get(..self.len).filter(|action| !action.is_empty())
    }
}

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

/// Keeps the power stage off: what stands here until a controller does.
#[derive(Debug)]
pub struct Off;

impl<S: Stage> Control<S> for Off {
    fn on_tick(&mut self, _: Option<&[f32]>, stage: &mut S) {
        stage.disable();
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

    #[test]
    fn an_action_that_is_too_long_is_none() {
        let mut output = Output::NONE;
        assert_eq!(output.get(), None);
        output.set(&[1.0, 2.0]);
        assert_eq!(output.get(), Some(&[1.0, 2.0][..]));
        output.set(&[0.0; MAX_ACTION + 1]);
        assert_eq!(output.get(), None);
    }
}
