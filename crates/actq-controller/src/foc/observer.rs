//! The rotor's angle and speed, from a sine-cosine sensor.

use core::f32::consts::{PI, TAU};

use super::functions::atan2;

/// Squared lengths of the shortest and the longest vector of the signals; the nominal length is 1. Outside this range a
/// wire is broken or the magnet is lost.
const LENGTHS: [f32; 2] = [0.25, 2.25];

/// Observer for a sensor whose two signals are the sine and cosine of the electrical angle: linear Hall sensors at the
/// rotor's magnet, or a resolver with the motor's number of pole pairs.
///
/// It is a critically damped alpha-beta filter, which has no error at constant speed (Brookner, Tracking and Kalman
/// Filtering Made Easy, 1998, section 1.2.6). It predicts the angle at which the duty cycles act.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observer {
    /// Shares of a tick's error that correct the angle and the speed.
    gains: [f32; 2],
    rotor: Option<Motion>,
}

/// Angle in radians, and speed in radians a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Motion {
    angle: f32,
    speed: f32,
}

impl Observer {
    /// Creates an observer without a measurement, for a bandwidth in rad/s and a tick in seconds.
    pub fn new(bandwidth: f32, tick: f32) -> Self {
        // The pole of a first-order filter of this bandwidth, by backward difference.
        let pole = 1.0 / (1.0 + bandwidth * tick);
        Self { gains: [1.0 - pole * pole, (1.0 - pole) * (1.0 - pole)], rotor: None }
    }

    /// Takes the signals of a tick, with a nominal amplitude of 1. Returns the angle `ahead` ticks later, in radians
    /// from -pi to pi.
    ///
    /// Returns `None` if the signals cannot be those of a turning magnet. The firmware must then switch the outputs
    /// off. The observer restarts with the next valid signals.
    pub fn step(&mut self, sin: f32, cos: f32, ahead: f32) -> Option<f32> {
        let [shortest, longest] = LENGTHS;
        self.rotor = if (shortest..=longest).contains(&(sin * sin + cos * cos)) {
            let measured = atan2(sin, cos);
            Some(match self.rotor {
                None => Motion { angle: measured, speed: 0.0 },
                Some(Motion { angle, speed }) => {
                    let (expected, [of_angle, of_speed]) = (angle + speed, self.gains);
                    let error = wrapped(measured - expected);
                    Motion { angle: wrapped(expected + of_angle * error), speed: speed + of_speed * error }
                }
            })
        } else {
            None
        };
        self.rotor.map(|Motion { angle, speed }| wrapped(angle + ahead * speed))
    }
}

/// Wraps an angle, at most a turn outside -pi to pi, into this range.
fn wrapped(angle: f32) -> f32 {
    if angle.abs() > PI { angle - TAU.copysign(angle) } else { angle }
}
