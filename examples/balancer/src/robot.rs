//! Dynamics of the robot: a body on two wheels that leans in the plane of motion, and turns about the vertical.

use crate::random::Random;

/// Largest torque of a motor, N m.
pub const TORQUE_LIMIT: f64 = 0.6;

const GRAVITY: f64 = 9.81;
/// Mass and radius of a wheel, and its moment of inertia about its axle.
const WHEEL_MASS: f64 = 0.1;
pub(crate) const WHEEL_RADIUS: f64 = 0.05;
const WHEEL_INERTIA: f64 = 0.5 * WHEEL_MASS * WHEEL_RADIUS * WHEEL_RADIUS;
/// Distance between the wheels.
pub(crate) const TRACK: f64 = 0.2;
/// Moment of inertia of the body about its centre of mass, and of the robot about the vertical.
const BODY_INERTIA: f64 = 0.006;
const YAW_INERTIA: f64 = 0.01;
/// Friction of rolling, N s/m, and of turning, N m s.
const ROLLING_FRICTION: f64 = 0.5;
const TURNING_FRICTION: f64 = 0.01;

/// State of the robot.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State {
    /// Forward speed.
    pub speed: f64,
    /// Lean of the body, forward positive.
    pub pitch: f64,
    /// Rate of the lean.
    pub pitch_rate: f64,
    /// Heading, left positive.
    pub yaw: f64,
    /// Rate of the heading.
    pub yaw_rate: f64,
}

/// A robot with its load.
#[derive(Clone, Debug)]
pub(crate) struct Robot {
    pub(crate) state: State,
    body_mass: f64,
    /// Height of the centre of mass above the axle.
    height: f64,
}

impl Robot {
    /// Makes a robot that leans a little, with a load that the policy does not know.
    pub(crate) fn new(random: &mut Random) -> Self {
        let mut about = |value: f64, share: f64| value * (1.0 + share * f64::from(random.unit()));
        let (body_mass, height) = (about(1.5, 0.2), about(0.1, 0.15));
        let pitch = 0.15 * f64::from(random.unit());
        Self { state: State { pitch, ..State::default() }, body_mass, height }
    }

    /// Advances by `dt` with the motors' torques (right, left) and a horizontal push at the centre of mass.
    ///
    /// The equations are those of a cart-pole whose cart is driven by wheels: a torque on the wheels acts on the body
    /// with the opposite sign.
    pub(crate) fn advance(&mut self, dt: f64, torques: [f64; 2], push: f64) {
        let State { speed, pitch, pitch_rate, yaw_rate, .. } = self.state;
        let [right, left] = torques.map(|torque| torque.clamp(-TORQUE_LIMIT, TORQUE_LIMIT));
        let (sine, cosine) = (libm::sin(pitch), libm::cos(pitch));
        let (torque, moment) = (right + left, self.body_mass * self.height);
        // [a b; b d] [acceleration; pitch acceleration] = [forward; turning]
        let a = self.body_mass + 2.0 * (WHEEL_MASS + WHEEL_INERTIA / (WHEEL_RADIUS * WHEEL_RADIUS));
        let (b, d) = (moment * cosine, BODY_INERTIA + moment * self.height);
        let forward = torque / WHEEL_RADIUS + moment * pitch_rate * pitch_rate * sine - ROLLING_FRICTION * speed + push;
        let turning = moment * GRAVITY * sine - torque + push * self.height * cosine;
        let determinant = a * d - b * b;
        let acceleration = (d * forward - b * turning) / determinant;
        let pitch_acceleration = (a * turning - b * forward) / determinant;
        let moment_of_yaw = (right - left) * TRACK / (2.0 * WHEEL_RADIUS) - TURNING_FRICTION * yaw_rate;
        let state = &mut self.state;
        state.speed += dt * acceleration;
        state.pitch_rate += dt * pitch_acceleration;
        state.yaw_rate += dt * moment_of_yaw / YAW_INERTIA;
        state.pitch += dt * state.pitch_rate;
        state.yaw += dt * state.yaw_rate;
    }
}
