//! The current loop.

use super::functions::{MOST_RADIANS, inverse_root_below};
use super::pi::Pi;
use super::pwm::duties;
use super::transform::{Angle, Rotor, Stator};

/// 1 / sqrt(3), less what rounding may add: the largest voltage that space-vector modulation reaches, as a share of the
/// supply.
const REACH: f32 = 0.577_35;

/// Gains of both axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gains {
    /// Volts for an ampere.
    pub proportional: f32,
    /// Volts for an ampere in one tick.
    pub integral: f32,
}

impl Gains {
    /// The gains that cancel the winding's pole and leave a first-order response of `bandwidth` rad/s, for a resistance
    /// in ohm, an inductance in henry and a tick in seconds.
    pub fn for_motor(resistance: f32, inductance: f32, bandwidth: f32, tick: f32) -> Self {
        Self { proportional: bandwidth * inductance, integral: bandwidth * resistance * tick }
    }
}

/// What was measured in a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Currents of the phases, in ampere.
    pub phases: [f32; 3],
    /// Electrical angle of the rotor, in radians, at the time when the duty cycles will act; within
    /// [`MOST_RADIANS`] of 0.
    pub angle: f32,
    /// Supply, in volts.
    pub supply: f32,
}

/// What came of a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tick {
    /// Duty cycles of the half bridges, 0 to 1.
    pub duties: [f32; 3],
    /// Currents in the rotor's axes, in ampere.
    pub current: Rotor,
    /// Voltages in the rotor's axes, in volts.
    pub voltage: Rotor,
}

/// Holds the currents of both axes at their targets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurrentLoop {
    gains: Gains,
    d: Pi,
    q: Pi,
}

impl CurrentLoop {
    /// A loop with nothing integrated yet.
    pub const fn new(gains: Gains) -> Self {
        Self { gains, d: Pi::new(), q: Pi::new() }
    }

    /// Forgets what was integrated: to be called where the outputs were not driven.
    pub fn reset(&mut self) {
        *self = Self::new(self.gains);
    }

    /// One tick towards `target`. The voltage stays within what the supply reaches; where it is not enough for both
    /// axes, d comes first, so that the flux is kept.
    ///
    /// `None`, and nothing changes, where a value is not finite, the angle beyond [`MOST_RADIANS`], or the supply not
    /// above 0 or its square not finite: the sensor is broken, and the firmware has to switch off.
    pub fn step(&mut self, measured: &Measured, target: Rotor) -> Option<Tick> {
        let Measured { phases, angle, supply } = *measured;
        let [a, b, c] = phases;
        let limit = REACH * supply;
        let square = limit * limit;
        let finite = [a, b, c, square, target.d, target.q].iter().all(|value| value.is_finite());
        if !finite || supply <= 0.0 || !(-MOST_RADIANS..=MOST_RADIANS).contains(&angle) {
            return None;
        }
        let angle = Angle::new(angle);
        let current = Stator::of_phases(phases).to_rotor(angle);
        let Gains { proportional, integral } = self.gains;
        let d = self.d.step(target.d - current.d, proportional, integral, limit);
        // What d leaves of the circle, squared.
        let left = square - d * d;
        let left = left * inverse_root_below(left);
        let q = self.q.step(target.q - current.q, proportional, integral, left);
        let voltage = Rotor { d, q };
        Some(Tick { duties: duties(voltage.to_stator(angle).phases(), supply), current, voltage })
    }
}
