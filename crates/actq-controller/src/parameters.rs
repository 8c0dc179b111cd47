//! Parameters that a host may set while disarmed, within the build's limits.

use actq_link::code::{Parameter, Refusal};

use crate::axis::Axis;
use crate::safety::Safety;

/// Largest number up to which f32 represents every whole number.
const MAX_WHOLE: u32 = 1 << 24;

/// Converts `value` to a whole number from `least` to `most`.
pub(crate) fn whole(value: f32, least: u32, most: u32) -> Result<u32, Refusal> {
    // The cast saturates, and gives 0 for NaN.
    let number = value as u32;
    let is_whole = number as f32 == value && (least..=most.min(MAX_WHOLE)).contains(&number);
    if is_whole { Ok(number) } else { Err(Refusal::Range) }
}

impl<const AXES: usize> Safety<AXES> {
    /// Returns the deadline, or a parameter of an axis.
    ///
    /// # Errors
    ///
    /// Returns [`Refusal::Parameter`] for another parameter and for an unknown axis.
    pub fn get(&self, parameter: Parameter, axis: u8) -> Result<f32, Refusal> {
        if parameter == Parameter::Deadline {
            return Ok(self.deadline as f32);
        }
        let axis = self.axes.get(usize::from(axis)).ok_or(Refusal::Parameter)?;
        match parameter {
            Parameter::Low => Ok(axis.low()),
            Parameter::High => Ok(axis.high()),
            Parameter::Rate => Ok(axis.rate()),
            Parameter::Start => Ok(axis.start()),
            Parameter::Deadline | Parameter::MaxAge | Parameter::StatusPeriod => Err(Refusal::Parameter),
        }
    }

    /// Sets a parameter that [`Self::get`] returns. Limits, rate and deadline may only be stricter than those of the
    /// build, the deadline not below its minimum.
    ///
    /// # Errors
    ///
    /// Fails as [`Self::may_change`] and [`Self::get`] do, and with [`Refusal::Range`] for a value outside the allowed
    /// range.
    pub fn set(&mut self, token: u32, parameter: Parameter, axis: u8, value: f32) -> Result<(), Refusal> {
        self.may_change(token)?;
        self.change_limits(|safety| safety.replace(parameter, axis, value))
    }

    fn replace(&mut self, parameter: Parameter, axis: u8, value: f32) -> Result<(), Refusal> {
        if parameter == Parameter::Deadline {
            let built = &self.built.deadline;
            self.deadline = whole(value, *built.start(), *built.end())?;
            return Ok(());
        }
        self.get(parameter, axis)?;
        let index = usize::from(axis);
        let (Some(axis), Some(built)) = (self.axes.get_mut(index), self.built.axes.get(index)) else {
            return Err(Refusal::Parameter);
        };
        let (mut low, mut high, mut rate, mut start) = (axis.low(), axis.high(), axis.rate(), axis.start());
        match parameter {
            Parameter::Low => low = value,
            Parameter::High => high = value,
            Parameter::Rate => rate = value,
            _ => start = value,
        }
        let new = Axis::new(low, high, rate, start, axis.safe()).map_err(|_| Refusal::Range)?;
        if new.low() < built.low() || new.high() > built.high() || new.rate() > built.rate() {
            return Err(Refusal::Range);
        }
        *axis = new;
        Ok(())
    }
}
