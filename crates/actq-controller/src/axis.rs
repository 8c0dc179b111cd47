//! An axis: its limits and its safe action.

use core::fmt;

use crate::safety::mix;

/// Action of an axis after the controller latched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SafeAction {
    /// Keeps driving the last value: holds a position.
    Hold,
    /// Shorts the motor's windings.
    Brake,
    /// Lets the motor turn.
    Coast,
    /// Drives the last value down to zero.
    Ramp {
        /// Change in a tick, above 0. A smaller rate of the axis comes first.
        step: f32,
    },
}

/// Output of an axis in a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Output {
    /// A value in the unit of the actions, within the limits.
    Drive(f32),
    /// Windings shorted.
    Brake,
    /// All switches open.
    Coast,
}

impl Output {
    /// Continues a checksum with its content.
    #[inline(always)]
    pub(crate) const fn sum(&self, sum: u32) -> u32 {
        match self {
            Self::Drive(value) => mix(mix(sum, 0), value.to_bits()),
            Self::Brake => mix(mix(sum, 1), 0),
            Self::Coast => mix(mix(sum, 2), 0),
        }
    }

    /// Returns `true` unless it drives a value outside the axis' limits. [`Safety::tick`](crate::Safety::tick) returns
    /// none: check it where the value becomes a duty cycle or a message, against faults of the processor.
    pub fn is_within(&self, axis: &Axis) -> bool {
        !matches!(self, Self::Drive(value) if !(axis.low..=axis.high).contains(value))
    }
}

/// Limits and safe action of an axis, in the unit of the actions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    low: f32,
    high: f32,
    rate: f32,
    start: f32,
    safe: SafeAction,
}

/// Reason why an axis is invalid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AxisError {
    /// A limit is not finite, or the lower one exceeds the upper one.
    Limits,
    /// The largest change in a tick is not positive, or so small that f32 rounds it away at the larger limit.
    Rate,
    /// The value at the start is outside the limits.
    Start,
    /// A ramp's step is not positive and finite, f32 rounds it away at the larger limit, or its end, 0, is outside the
    /// limits.
    Ramp,
}

impl fmt::Display for AxisError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Limits => "an axis' limits are not finite or reversed",
            Self::Rate => "an axis' largest change in a tick is not positive, or too small beside its limits",
            Self::Start => "an axis' value at the start is outside its limits",
            Self::Ramp => {
                "an axis' ramp has no positive step, one too small beside its limits, or limits that exclude its end, 0"
            }
        })
    }
}

impl core::error::Error for AxisError {}

impl Axis {
    /// An axis without limits, and so without a rate: it may not leave 0, and prevents arming.
    pub const STILL: Self = Self { low: 0.0, high: 0.0, rate: 0.0, start: 0.0, safe: SafeAction::Coast };

    /// Creates an axis with finite limits `low` to `high` that changes by at most `rate` in a tick (infinite: at once).
    /// Its first value after arming differs from `start` by at most `rate`.
    ///
    /// # Errors
    ///
    /// Fails if these values are invalid; see [`AxisError`].
    pub fn new(low: f32, high: f32, rate: f32, start: f32, safe: SafeAction) -> Result<Self, AxisError> {
        if !(low.is_finite() && high.is_finite() && low <= high) {
            return Err(AxisError::Limits);
        }
        // A smaller change may leave a value as it is, for ever.
        let least = f32::EPSILON * if -low > high { -low } else { high };
        if !(rate > 0.0 && rate >= least) {
            return Err(AxisError::Rate);
        }
        if !(low..=high).contains(&start) {
            return Err(AxisError::Start);
        }
        if let SafeAction::Ramp { step } = safe
            && !(step > 0.0 && step >= least && step.is_finite() && (low..=high).contains(&0.0))
        {
            return Err(AxisError::Ramp);
        }
        Ok(Self { low, high, rate, start, safe })
    }

    /// Returns `true` only for [`Self::STILL`]: an axis of [`Self::new`] always has a rate.
    pub fn is_still(&self) -> bool {
        self.rate == 0.0
    }

    /// Returns the lower limit.
    pub const fn low(&self) -> f32 {
        self.low
    }

    /// Returns the upper limit.
    pub const fn high(&self) -> f32 {
        self.high
    }

    /// Returns the largest change in a tick.
    pub const fn rate(&self) -> f32 {
        self.rate
    }

    /// Returns the value from which the first change after arming is limited.
    pub const fn start(&self) -> f32 {
        self.start
    }

    /// Returns the action after latching.
    pub const fn safe(&self) -> SafeAction {
        self.safe
    }

    /// Continues a checksum with its content.
    #[inline(always)]
    pub(crate) const fn sum(&self, sum: u32) -> u32 {
        let Self { low, high, rate, start, safe } = self;
        let sum = mix(mix(mix(mix(sum, low.to_bits()), high.to_bits()), rate.to_bits()), start.to_bits());
        match safe {
            SafeAction::Hold => mix(mix(sum, 0), 0),
            SafeAction::Brake => mix(mix(sum, 1), 0),
            SafeAction::Coast => mix(mix(sum, 2), 0),
            SafeAction::Ramp { step } => mix(mix(sum, 3), step.to_bits()),
        }
    }

    /// Limits a finite value. It compares, because a Cortex-M4 has no instruction for `f32::max` and would call a
    /// function in the tick.
    pub(crate) fn limit(&self, value: f32) -> f32 {
        match value {
            below if below < self.low => self.low,
            above if above > self.high => self.high,
            within => within,
        }
    }

    /// Returns the output one tick after `last` towards `target`. An axis that was not driven begins at the start
    /// value.
    pub(crate) fn follow(&self, last: Output, target: f32) -> Output {
        let last = if let Output::Drive(value) = last { value } else { self.start };
        Output::Drive(self.limit(towards(last, target, self.rate)))
    }

    /// Returns the output of the safe action one tick after `last`. An axis that was not driven has nothing to hold.
    pub(crate) fn rest(&self, last: Output) -> Output {
        match (self.safe, last) {
            (SafeAction::Brake, _) => Output::Brake,
            (SafeAction::Coast, _) => Output::Coast,
            (SafeAction::Hold | SafeAction::Ramp { .. }, Output::Brake | Output::Coast) => last,
            (SafeAction::Hold, Output::Drive(_)) => last,
            (SafeAction::Ramp { step }, Output::Drive(value)) => {
                let step = if self.rate < step { self.rate } else { step };
                Output::Drive(towards(value, 0.0, step))
            }
        }
    }
}

/// Moves `from` towards `to` by at most `step`.
fn towards(from: f32, to: f32, step: f32) -> f32 {
    let way = to - from;
    if way.abs() <= step { to } else { from + step.copysign(way) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_that_rounding_swallows_are_refused() {
        let axis = |rate: f32, step: f32| Axis::new(-1e6, 4e5, rate, 0.0, SafeAction::Ramp { step });
        assert_eq!([axis(0.1, 1.0), axis(f32::NAN, 1.0)], [Err(AxisError::Rate); 2]);
        assert_eq!([axis(1.0, 0.1), axis(1.0, f32::INFINITY)], [Err(AxisError::Ramp); 2]);
        let axis = axis(0.12, 1.0).expect("the axis is valid");
        let mut last = Output::Drive(-1e6);
        // Rounded to multiples of 1/16 at first, by half of one at most.
        let ticks = (0..20_000_000).take_while(|_| {
            last = axis.rest(last);
            last != Output::Drive(0.0)
        });
        assert!(ticks.count() < 16_000_000, "{last:?}");
    }
}
