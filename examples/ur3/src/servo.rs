//! Joint servo dynamics: from velocity commands to joint motion at 500 Hz.

use core::f64::consts::{PI, TAU};

use crate::kinematics::Joints;

/// Largest joint velocity command, rad/s; both the expert and the action contract stay within it.
pub const COMMAND_LIMIT: Joints = [1.5, 1.5, 1.5, 2.0, 2.0, 2.0];

/// Joint angles of the mechanical stops, rad: the part of the arm's range that this task uses.
pub const STOPS: [(f64, f64); 6] = [(-2.0, 2.0), (-2.6, -0.3), (0.3, 2.6), (-3.2, -0.4), (-2.8, -0.3), (-2.5, 2.5)];

/// Servo period, s.
const PERIOD: f64 = 0.002;
/// Servo periods in one control step of 20 ms.
const PERIODS_PER_STEP: usize = 10;
/// Servo periods before a command takes effect: the time on the field bus.
const DELAY: usize = 2;
/// Time constant of the velocity loop, s.
const TIME_CONSTANT: f64 = 0.04;
/// Largest acceleration that the velocity loop demands, rad/s².
const ACCELERATION_LIMIT: f64 = 15.0;
/// Joint speed limits of the arm, rad/s.
const SPEED_LIMIT: Joints = [PI, PI, PI, TAU, TAU, TAU];
/// Coulomb friction, as deceleration, rad/s².
const FRICTION: f64 = 0.3;
/// Speed at which friction has half its full value, rad/s; keeps friction continuous through standstill.
const FRICTION_SPEED: f64 = 0.01;

/// Six joints with velocity loops. The loop is proportional: friction leaves a small velocity error, and a push
/// displaces the joint permanently, so that the source of the commands must correct the position.
#[derive(Clone, Debug)]
pub struct Servo {
    /// Joint angles, rad.
    pub angle: Joints,
    /// Joint velocities, rad/s.
    pub velocity: Joints,
    in_flight: [Joints; DELAY],
}

impl Servo {
    /// Creates joints at rest at `angle` (rad).
    pub fn new(angle: Joints) -> Self {
        Self { angle, velocity: [0.0; 6], in_flight: [[0.0; 6]; DELAY] }
    }

    /// Runs one control step (20 ms) with velocity command `command` (rad/s, clamped to [`COMMAND_LIMIT`]) while an
    /// external force accelerates the joints by `push` (rad/s²).
    pub fn step(&mut self, command: &Joints, push: &Joints) {
        let command = core::array::from_fn(|i| command[i].clamp(-COMMAND_LIMIT[i], COMMAND_LIMIT[i]));
        for _ in 0..PERIODS_PER_STEP {
            let reference = self.in_flight[0];
            self.in_flight.rotate_left(1);
            self.in_flight[DELAY - 1] = command;
            for i in 0..6 {
                self.step_joint(i, reference[i], push[i]);
            }
        }
    }

    fn step_joint(&mut self, i: usize, reference: f64, push: f64) {
        let velocity = self.velocity[i];
        let demand = ((reference - velocity) / TIME_CONSTANT).clamp(-ACCELERATION_LIMIT, ACCELERATION_LIMIT);
        let friction = FRICTION * velocity / (velocity.abs() + FRICTION_SPEED);
        let velocity = velocity + (demand - friction + push) * PERIOD;
        self.velocity[i] = velocity.clamp(-SPEED_LIMIT[i], SPEED_LIMIT[i]);

        let angle = self.angle[i] + self.velocity[i] * PERIOD;
        self.angle[i] = angle.clamp(STOPS[i].0, STOPS[i].1);
        if self.angle[i] != angle {
            self.velocity[i] = 0.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const START: Joints = [0.0, -1.1, 1.5, -1.97, -1.57, 0.0];

    #[test]
    fn velocity_settles_near_the_command() {
        let mut servo = Servo::new(START);
        for _ in 0..25 {
            servo.step(&[0.5; 6], &[0.0; 6]);
        }
        // Friction costs at most FRICTION * TIME_CONSTANT.
        for velocity in servo.velocity {
            assert!((0.5 - 0.012..0.5).contains(&velocity), "velocity {velocity}");
        }
    }

    #[test]
    fn acceleration_is_limited() {
        let mut servo = Servo::new(START);
        servo.step(&[10.0; 6], &[0.0; 6]);
        for velocity in servo.velocity {
            assert!(velocity <= ACCELERATION_LIMIT * 0.02, "velocity {velocity}");
        }
    }

    #[test]
    fn stops_hold_the_joint() {
        let mut servo = Servo::new(START);
        for _ in 0..200 {
            servo.step(&[1.5; 6], &[0.0; 6]);
        }
        for (angle, (_, high)) in servo.angle.into_iter().zip(STOPS) {
            assert_eq!(angle, high);
        }
    }

    #[test]
    fn a_push_displaces_the_joint() {
        let mut servo = Servo::new(START);
        let push = [10.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        for i in 0..50 {
            servo.step(&[0.0; 6], if i < 5 { &push } else { &[0.0; 6] });
        }
        assert!(servo.angle[0] > 0.01, "angle {}", servo.angle[0]);
        assert!((servo.angle[1] - START[1]).abs() < 1e-12);
    }
}
