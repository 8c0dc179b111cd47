//! The expert controller: damped least squares with a null-space pull to the home posture.

use crate::CHUNK;
use crate::kinematics::{self, Goal, Joints, Vector, chain, dot, jacobian, norm, pose_error, scale};
use crate::servo::{COMMAND_LIMIT, STOPS, Servo};

/// Posture with the tool pointing down in front of the arm, rad.
pub const HOME: Joints = [0.0, -1.1, 1.5, -1.97, -1.57, 0.0];

/// Tool velocity for each unit of pose error, 1/s.
const GAIN: f64 = 5.0;
/// Largest linear velocity of the tool, m/s.
const LINEAR_LIMIT: f64 = 0.5;
/// Largest angular velocity of the tool, rad/s.
const ANGULAR_LIMIT: f64 = 1.5;
/// Damping of the inverse: bounds the joint velocities near singular postures at the cost of some speed there.
const DAMPING: f64 = 0.03;
/// Joint velocity for each radian away from home, within the null space, 1/s.
const HOME_GAIN: f64 = 1.0;
/// Joint velocity towards a stop for each remaining radian, 1/s.
const STOP_GAIN: f64 = 5.0;

/// Task rows: three of position, two of the tool axis. The turn about the tool axis is free, so that one of the six
/// joint dimensions remains for the pull to home.
const ROWS: usize = 5;

/// Computes the joint velocity command (rad/s) towards `goal` at joint angles `angle`.
pub fn command(angle: &Joints, goal: &Goal) -> Joints {
    let frames = chain(angle);
    let tool = &frames[6];
    let error = pose_error(tool, goal);
    let linear = limit(scale(error.position, GAIN), LINEAR_LIMIT);
    let angular = limit(scale(error.rotation, GAIN), ANGULAR_LIMIT);
    let [tool_x, tool_y, _] = tool.axes;
    let task = |linear: Vector, angular: Vector| -> [f64; ROWS] {
        [linear[0], linear[1], linear[2], dot(tool_x, angular), dot(tool_y, angular)]
    };
    let columns = jacobian(&frames).map(|(linear, angular)| task(linear, angular));

    let home: Joints = core::array::from_fn(|i| HOME_GAIN * (HOME[i] - angle[i]));
    // J+ (v - J home) + home equals J+ v + (I - J+ J) home with only one solve.
    let mut wanted = task(linear, angular);
    for (row, value) in wanted.iter_mut().enumerate() {
        *value -= (0..6).map(|i| columns[i][row] * home[i]).sum::<f64>();
    }
    let weights = solve_damped(&columns, wanted);
    let free: Joints =
        core::array::from_fn(|i| home[i] + (0..ROWS).map(|row| columns[i][row] * weights[row]).sum::<f64>());

    // One common factor keeps the direction of the motion.
    let factor = (0..6).map(|i| COMMAND_LIMIT[i] / free[i].abs()).fold(1.0, f64::min);
    core::array::from_fn(|i| {
        let (low, high) = STOPS[i];
        // Within the stops the bounds have opposite signs, so the clamp is always valid.
        (free[i] * factor).clamp(STOP_GAIN * (low - angle[i]).min(0.0), STOP_GAIN * (high - angle[i]).max(0.0))
    })
}

/// Computes the next [`CHUNK`] commands (rad/s) towards `goal`: the expert run forward on a copy of the arm, without
/// noise or pushes.
pub fn plan(servo: &Servo, goal: &Goal) -> [Joints; CHUNK] {
    let mut servo = servo.clone();
    core::array::from_fn(|_| {
        let command = command(&servo.angle, goal);
        servo.step(&command, &[0.0; 6]);
        command
    })
}

fn limit(v: Vector, most: f64) -> Vector {
    let length = norm(v);
    if length > most { kinematics::scale(v, most / length) } else { v }
}

/// Solves `(J J' + DAMPING^2) x = b` by Cholesky factors; `columns[joint][row]` is J.
fn solve_damped(columns: &[[f64; ROWS]; 6], b: [f64; ROWS]) -> [f64; ROWS] {
    let mut factor = [[0.0; ROWS]; ROWS];
    for r in 0..ROWS {
        for c in 0..=r {
            let mut sum: f64 = columns.iter().map(|column| column[r] * column[c]).sum();
            if r == c {
                sum += DAMPING * DAMPING;
            }
            sum -= (0..c).map(|k| factor[r][k] * factor[c][k]).sum::<f64>();
            factor[r][c] = if r == c { sum.sqrt() } else { sum / factor[c][c] };
        }
    }
    let mut x = b;
    for r in 0..ROWS {
        let known: f64 = (0..r).map(|k| factor[r][k] * x[k]).sum();
        x[r] = (x[r] - known) / factor[r][r];
    }
    for r in (0..ROWS).rev() {
        let known: f64 = (r + 1..ROWS).map(|k| factor[k][r] * x[k]).sum();
        x[r] = (x[r] - known) / factor[r][r];
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinematics::tool;

    fn goal_at(angle: &Joints) -> Goal {
        let frame = tool(angle);
        Goal { position: frame.position, axis: frame.z() }
    }

    #[test]
    fn home_is_at_rest() {
        for velocity in command(&HOME, &goal_at(&HOME)) {
            assert!(velocity.abs() < 1e-12, "velocity {velocity}");
        }
    }

    #[test]
    fn commands_stay_within_limits() {
        let mut random = crate::random::Random::new(3);
        for _ in 0..1000 {
            let mut draw = || -> Joints { core::array::from_fn(|i| random.range(STOPS[i].0, STOPS[i].1)) };
            let (from, to) = (draw(), draw());
            for (velocity, most) in command(&from, &goal_at(&to)).into_iter().zip(COMMAND_LIMIT) {
                assert!(velocity.abs() <= most * (1.0 + 1e-12), "velocity {velocity}");
            }
        }
    }

    #[test]
    fn plan_starts_with_the_command() {
        let goal = goal_at(&[0.4, -1.2, 1.3, -1.8, -1.4, 0.0]);
        let plan = plan(&Servo::new(HOME), &goal);
        assert_eq!(plan[0], command(&HOME, &goal));
        assert_ne!(plan[0], plan[CHUNK - 1]);
    }
}
