//! The current loop.

use super::functions::{MAX_RADIANS, inverse_root_below};
use super::pi::Pi;
use super::pwm::duties;
use super::transform::{Angle, Rotor, Stator};

/// 1 / sqrt(3) minus a margin for rounding: the largest voltage that space-vector modulation reaches, as a share of the
/// supply.
const REACH: f32 = 0.577_35;

/// Gains of both axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gains {
    /// Proportional gain, in volts per ampere.
    pub proportional: f32,
    /// Integral gain, in volts per ampere and tick.
    pub integral: f32,
}

impl Gains {
    /// Returns the gains that cancel the winding's pole and give a first-order response of `bandwidth` rad/s.
    /// Resistance is in ohm, inductance in henry, the tick in seconds.
    pub fn for_motor(resistance: f32, inductance: f32, bandwidth: f32, tick: f32) -> Self {
        Self { proportional: bandwidth * inductance, integral: bandwidth * resistance * tick }
    }
}

/// Measurements of a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Currents of the phases, in ampere.
    pub phases: [f32; 3],
    /// Electrical angle of the rotor when the duty cycles act, in radians, within [`MAX_RADIANS`] of 0.
    pub angle: f32,
    /// Supply voltage, in volts.
    pub supply: f32,
}

/// Results of a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tick {
    /// Duty cycles of the half bridges, 0 to 1.
    pub duties: [f32; 3],
    /// Currents in the rotor's axes, in ampere.
    pub current: Rotor,
    /// Voltages in the rotor's axes, in volts.
    pub voltage: Rotor,
}

/// Controller that holds the currents of both axes at their targets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurrentLoop {
    gains: Gains,
    d: Pi,
    q: Pi,
}

impl CurrentLoop {
    /// Creates a loop with zero integrals.
    pub const fn new(gains: Gains) -> Self {
        Self { gains, d: Pi::new(), q: Pi::new() }
    }

    /// Clears the integrals. Call it when the outputs were not driven.
    pub fn reset(&mut self) {
        *self = Self::new(self.gains);
    }

    /// Computes one tick towards `target`. The voltage stays within the supply's limit. If it is not enough for both
    /// axes, d has priority, which preserves the flux.
    ///
    /// Returns `None` without any change if a value, a gain or the supply's square is not finite, the supply is not
    /// positive, or the angle is beyond [`MAX_RADIANS`]. The sensor is then broken, and the firmware must switch the
    /// outputs off.
    pub fn step(&mut self, measured: &Measured, target: Rotor) -> Option<Tick> {
        let Measured { phases, angle, supply } = *measured;
        let [a, b, c] = phases;
        let limit = REACH * supply;
        let square = limit * limit;
        let Gains { proportional, integral } = self.gains;
        let values = [a, b, c, square, target.d, target.q, proportional, integral];
        let finite = values.iter().all(|value| value.is_finite());
        if !finite || supply <= 0.0 || !(-MAX_RADIANS..=MAX_RADIANS).contains(&angle) {
            return None;
        }
        let angle = Angle::new(angle);
        let current = Stator::of_phases(phases).to_rotor(angle);
        let d = self.d.step(target.d - current.d, proportional, integral, limit);
        // The square of the voltage that d leaves for q.
        let left = square - d * d;
        let left = left * inverse_root_below(left);
        let q = self.q.step(target.q - current.q, proportional, integral, left);
        let voltage = Rotor { d, q };
        Some(Tick { duties: duties(voltage.to_stator(angle).phases(), supply), current, voltage })
    }
}
