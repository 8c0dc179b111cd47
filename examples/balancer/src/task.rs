//! The task: to drive at commanded speeds and turn rates, in spite of pushes, noise and an unknown load.

use anyhow::Result;

use crate::random::Random;
use crate::robot::{Robot, State, TRACK, WHEEL_RADIUS};

/// Values of all sensors and of the command, one after the other: angular velocity (3), orientation (4: w, x, y, z),
/// wheel velocities (2: right, left), command (2: speed, turn rate).
pub const RAW_LEN: usize = 11;

/// Control steps a second, and simulated steps in each.
pub const RATE_HZ: usize = 100;
const SUBSTEPS: usize = 10;
/// Steps of a command, and steps at its end in which it must be followed.
const COMMAND_STEPS: usize = 250;
const HOLD_STEPS: usize = 80;
/// Steps of an episode: four commands.
pub const EPISODE_STEPS: usize = 4 * COMMAND_STEPS;
/// Largest commands, m/s and rad/s.
const COMMANDS: [f64; 2] = [0.6, 1.5];
/// Largest push, and its steps.
const PUSH: f64 = 4.0;
const PUSH_STEPS: usize = 20;
/// A robot that leans further has fallen.
const FALLEN: f64 = 0.7;
/// Largest mean errors of speed and turn rate at the end of a command.
const SUCCESS: [f64; 2] = [0.1, 0.2];
/// Standard deviations of the sensors' noise: angular velocity, lean, wheel velocities.
const NOISE: [f64; 3] = [0.02, 0.003, 0.1];

/// Outcome of an episode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// It stood, and followed each command at its end.
    pub success: bool,
    /// Mean error of the speed at the end of the commands, m/s; infinite if it fell.
    pub speed_error: f64,
}

/// An episode.
#[derive(Clone, Debug)]
pub struct Task {
    robot: Robot,
    random: Random,
    step: usize,
    command: [f64; 2],
    push: f64,
    push_at: usize,
    /// Sums of the errors in the hold phase of each command.
    errors: Vec<[f64; 2]>,
    fallen: bool,
}

impl Task {
    /// Begins the episode of a seed.
    pub fn new(seed: u64) -> Self {
        let mut random = Random::new(seed);
        let robot = Robot::new(&mut random);
        let mut task = Self {
            robot,
            random,
            step: 0,
            command: [0.0; 2],
            push: 0.0,
            push_at: 0,
            errors: Vec::new(),
            fallen: false,
        };
        task.next_command();
        task
    }

    fn next_command(&mut self) {
        self.command = COMMANDS.map(|most| most * f64::from(self.random.unit()));
        self.push = PUSH * f64::from(self.random.unit());
        self.push_at = self.step + self.random.below(COMMAND_STEPS - HOLD_STEPS - 100);
        self.errors.push([0.0; 2]);
    }

    /// Returns `true` after the last step, or after a fall.
    pub fn is_over(&self) -> bool {
        self.fallen || self.step == EPISODE_STEPS
    }

    /// Returns the true state and the command, for the expert.
    pub fn truth(&self) -> (&State, [f64; 2]) {
        (&self.robot.state, self.command)
    }

    /// Pushes the robot at its centre of mass with `force` N, from now on for as long as the task's own pushes last.
    pub fn push(&mut self, force: f64) {
        (self.push, self.push_at) = (force, self.step);
    }

    /// Replaces the command of speed (m/s) and turn rate (rad/s), until the task's next one.
    pub fn command(&mut self, command: [f64; 2]) {
        self.command = command;
    }

    /// Returns what the sensors show, and the command ([`RAW_LEN`]). It differs in each call, by noise.
    pub fn sense(&mut self) -> [f32; RAW_LEN] {
        let State { speed, pitch, pitch_rate, yaw, yaw_rate } = self.robot.state;
        let mut noise = |deviation: f64| deviation * f64::from(self.random.normal());
        let [gyro, lean, wheel] = NOISE;
        // The sensor leans with the body, and so shows the turn rate about two axes.
        let (sine, cosine) = (libm::sin(pitch), libm::cos(pitch));
        let rates = [-yaw_rate * sine, pitch_rate, yaw_rate * cosine].map(|rate| rate + noise(gyro));
        let half = [0.5 * yaw, 0.5 * (pitch + noise(lean))];
        let [(sy, cy), (sp, cp)] = half.map(|angle| (libm::sin(angle), libm::cos(angle)));
        // Turned about the vertical, then leaned.
        let orientation = [cy * cp, -sy * sp, cy * sp, sy * cp];
        // An encoder shows the wheel's turn against the body.
        let turn = yaw_rate * TRACK / 2.0;
        let wheels = [speed + turn, speed - turn].map(|v| v / WHEEL_RADIUS - pitch_rate + noise(wheel));
        let mut raw = [0.0; RAW_LEN];
        let all = rates.iter().chain(&orientation).chain(&wheels).chain(&self.command);
        raw.iter_mut().zip(all).for_each(|(to, from)| *to = *from as f32);
        raw
    }

    /// Lets the motors apply torques (right, left) for one control step.
    pub fn apply(&mut self, torques: [f64; 2]) {
        let push = if (self.push_at..self.push_at + PUSH_STEPS).contains(&self.step) { self.push } else { 0.0 };
        for _ in 0..SUBSTEPS {
            self.robot.advance(1.0 / (RATE_HZ * SUBSTEPS) as f64, torques, push);
        }
        let state = self.robot.state;
        self.fallen = state.pitch.abs() > FALLEN;
        if self.step % COMMAND_STEPS >= COMMAND_STEPS - HOLD_STEPS {
            let errors = [state.speed - self.command[0], state.yaw_rate - self.command[1]];
            let sums = self.errors.iter_mut().last();
            sums.into_iter().flatten().zip(errors).for_each(|(sum, error)| *sum += error / HOLD_STEPS as f64);
        }
        self.step += 1;
        if self.step.is_multiple_of(COMMAND_STEPS) && self.step < EPISODE_STEPS {
            self.next_command();
        }
    }

    /// Returns the outcome of an episode that is over.
    pub fn outcome(&self) -> Outcome {
        let holds = |error: &[f64; 2]| error.iter().zip(SUCCESS).all(|(error, most)| error.abs() < most);
        let mean = self.errors.iter().map(|[speed, _]| speed.abs()).sum::<f64>() / self.errors.len() as f64;
        Outcome {
            success: !self.fallen && self.errors.iter().all(holds),
            speed_error: if self.fallen { f64::INFINITY } else { mean },
        }
    }
}

/// Runs the episode of a seed with a policy from raw values to torques (right, left).
///
/// # Errors
///
/// The policy's first error.
pub fn run_episode(seed: u64, mut policy: impl FnMut(&[f32]) -> Result<[f32; 2]>) -> Result<Outcome> {
    let mut task = Task::new(seed);
    while !task.is_over() {
        let raw = task.sense();
        task.apply(policy(&raw)?.map(f64::from));
    }
    Ok(task.outcome())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expert;

    #[test]
    fn the_expert_succeeds() {
        for seed in 0..50 {
            let mut task = Task::new(seed);
            while !task.is_over() {
                let (state, command) = task.truth();
                task.apply(expert::torques(state, command));
            }
            assert!(task.outcome().success, "seed {seed}: {:?} {:?}", task.outcome(), task.errors);
        }
    }
}
