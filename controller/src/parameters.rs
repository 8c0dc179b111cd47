//! What may be set while disarmed, within what the build allows.

use actq_link::code::{Parameter, Refusal};

use crate::axis::Axis;
use crate::safety::Safety;

/// The largest whole number up to which f32 has all of them.
const MOST_WHOLE: u32 = 1 << 24;

/// A whole number from `least` to `most`.
pub(crate) fn whole(value: f32, least: u32, most: u32) -> Result<u32, Refusal> {
    // Saturates, and is 0 for NaN.
    let number = value as u32;
    let is_whole = number as f32 == value && (least..=most.min(MOST_WHOLE)).contains(&number);
    if is_whole { Ok(number) } else { Err(Refusal::Range) }
}

impl<const AXES: usize> Safety<AXES> {
    /// The value of a parameter of the axes or of the deadline.
    ///
    /// # Errors
    ///
    /// [`Refusal::Parameter`] where it is another one, or there is no such axis.
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

    /// Sets one of the parameters that [`Self::get`] gives. Limits, rate and deadline only become stricter than those
    /// of the build, the deadline not below its least.
    ///
    /// # Errors
    ///
    /// As [`Self::may_change`] and [`Self::get`], and [`Refusal::Range`] where the value is not one that it may have.
    pub fn set(&mut self, token: u32, parameter: Parameter, axis: u8, value: f32) -> Result<(), Refusal> {
        self.may_change(token)?;
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
