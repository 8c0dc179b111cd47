//! The expert: linear feedback of the true state, which no sensor shows.

use crate::robot::{State, TORQUE_LIMIT};

/// Torque of both motors per error of speed, lean and rate of lean: the linear quadratic regulator of the robot without
/// load, for costs of 3, 1 and 0.05, and of 2 for the torque, at 100 Hz.
const SPEED_GAIN: f64 = 0.811;
const PITCH_GAIN: f64 = 2.319;
const PITCH_RATE_GAIN: f64 = 0.281;
/// Difference of the motors' torques per error of the turn rate.
const TURN_GAIN: f64 = 0.05;

/// Returns the torques (right, left) for a command of speed and turn rate.
pub fn torques(state: &State, [speed, turn]: [f64; 2]) -> [f64; 2] {
    let both = SPEED_GAIN * (state.speed - speed) + PITCH_GAIN * state.pitch + PITCH_RATE_GAIN * state.pitch_rate;
    let difference = TURN_GAIN * (turn - state.yaw_rate);
    [both + difference, both - difference].map(|torque| (0.5 * torque).clamp(-TORQUE_LIMIT, TORQUE_LIMIT))
}
