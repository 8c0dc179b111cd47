//! The reach-and-hold task: two goals in turn, a push on the way to each, noisy observations.

use crate::expert::{self, HOME};
use crate::kinematics::{Goal, Joints, PoseError, Vector, norm, pose_error, subtract, tool};
use crate::random::Random;
use crate::servo::Servo;
use crate::{ACT_DIM, OBS_DIM};

/// Control steps per second.
pub const CONTROL_HZ: usize = 50;
/// Control steps in an episode (4 s).
pub const EPISODE_STEPS: usize = GOALS * STEPS_PER_GOAL;
/// Largest mean distance to the goal during a hold phase for success, m.
pub const POSITION_TOLERANCE: f64 = 0.010;
/// Largest mean angle between tool axis and goal axis during a hold phase for success, rad.
pub const AXIS_TOLERANCE: f64 = 0.10;

const GOALS: usize = 2;
const STEPS_PER_GOAL: usize = 100;
/// The last 0.4 s before a goal is replaced is its hold phase, in which errors are measured.
const HOLD_STEPS: usize = 20;
/// A push begins within these steps of a goal: late enough to disturb the approach, early enough to recover.
const PUSH_START: (f64, f64) = (10.0, 50.0);
/// Duration of a push, control steps.
const PUSH_STEPS: usize = 5;
/// Largest acceleration of one joint by a push, rad/s².
const PUSH_ACCELERATION: f64 = 12.0;
/// Range of the random joints of start postures and goals around home, rad.
const POSTURE_RANGE: Joints = [0.7, 0.3, 0.4, 0.4, 0.4, 0.6];
/// Smallest height of the tool in a random posture, m: keeps it above the table.
const TABLE_CLEARANCE: f64 = 0.03;
/// Smallest distance between consecutive postures' tool positions, m: every goal needs a motion.
const SMALLEST_REACH: f64 = 0.10;

/// Standard deviations of the observation noise: joint angle (rad), joint velocity (rad/s), position error (m), axis
/// error (rad).
const NOISE: [f64; 4] = [0.0005, 0.005, 0.0005, 0.002];

struct Push {
    start: usize,
    acceleration: Joints,
}

/// One episode of the task. Equal seeds and actions give equal episodes.
pub struct Task {
    servo: Servo,
    goals: [Goal; GOALS],
    pushes: [Push; GOALS],
    step: usize,
    noise: Random,
    observation: [f32; OBS_DIM],
    /// Sums over each hold phase: distance (m) and axis angle (rad).
    held: [(f64, f64); GOALS],
}

/// The result of an episode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// `true` if the mean errors of every hold phase are within [`POSITION_TOLERANCE`] and [`AXIS_TOLERANCE`].
    pub success: bool,
    /// Distance between tool and goal at the end of the episode, m.
    pub final_error_m: f64,
    /// Mean distance between tool and goal over the hold phases, m.
    pub tracking_error_m: f64,
    /// Mean angle between tool axis and goal axis over the hold phases, rad.
    pub axis_error_rad: f64,
}

impl Task {
    /// Creates an episode with start posture, goals, pushes and noise drawn from `seed`.
    pub fn new(seed: u64) -> Self {
        let mut random = Random::new(seed);
        let start = draw_posture(&mut random);
        let mut last = tool(&start).position;
        let goals = core::array::from_fn(|_| {
            loop {
                let frame = tool(&draw_posture(&mut random));
                if norm(subtract(frame.position, last)) >= SMALLEST_REACH {
                    last = frame.position;
                    return Goal { position: frame.position, axis: frame.z() };
                }
            }
        });
        let pushes = core::array::from_fn(|_| Push {
            start: random.range(PUSH_START.0, PUSH_START.1) as usize,
            acceleration: core::array::from_fn(|_| random.range(-PUSH_ACCELERATION, PUSH_ACCELERATION)),
        });
        let mut task = Self {
            servo: Servo::new(start),
            goals,
            pushes,
            step: 0,
            noise: random,
            observation: [0.0; OBS_DIM],
            held: [(0.0, 0.0); GOALS],
        };
        task.sense();
        task
    }

    /// Returns the current observation: joint angles (6, rad), joint velocities (6, rad/s), goal minus tool position
    /// (3, m), rotation vector from tool axis to goal axis (3, rad), all with noise, vectors in the base frame.
    pub fn observe(&self) -> [f32; OBS_DIM] {
        self.observation
    }

    /// Returns the joint angles, without noise.
    pub fn joints(&self) -> &Joints {
        &self.servo.angle
    }

    /// Returns the present goal.
    pub fn goal(&self) -> &Goal {
        &self.goals[self.phase()]
    }

    /// Replaces the position of the present goal, m.
    pub fn move_goal(&mut self, position: Vector) {
        let phase = self.phase();
        self.goals[phase].position = position;
    }

    /// Pushes a joint with this acceleration, rad/s², from now on for as long as the task's own pushes last.
    pub fn push(&mut self, joint: usize, acceleration: f64) {
        let (phase, start) = (self.phase(), self.step % STEPS_PER_GOAL);
        let mut all = [0.0; 6];
        if let Some(value) = all.get_mut(joint) {
            *value = acceleration;
        }
        self.pushes[phase] = Push { start, acceleration: all };
    }

    /// Runs one control step (20 ms) with joint velocity commands `action` (rad/s). NaN counts as 0, as with a servo's
    /// watchdog. No effect after the end of the episode.
    pub fn step(&mut self, action: &[f32; ACT_DIM]) {
        if self.is_over() {
            return;
        }
        let command = action.map(|x| if x.is_nan() { 0.0 } else { f64::from(x) });
        let phase = self.phase();
        let within = self.step % STEPS_PER_GOAL;
        let push = &self.pushes[phase];
        let pushed = (push.start..push.start + PUSH_STEPS).contains(&within);
        self.servo.step(&command, if pushed { &push.acceleration } else { &[0.0; 6] });

        if within >= STEPS_PER_GOAL - HOLD_STEPS {
            let error = self.error(phase);
            self.held[phase].0 += norm(error.position) / HOLD_STEPS as f64;
            self.held[phase].1 += norm(error.rotation) / HOLD_STEPS as f64;
        }
        self.step += 1;
        self.sense();
    }

    /// Returns `true` after all [`EPISODE_STEPS`].
    pub fn is_over(&self) -> bool {
        self.step == EPISODE_STEPS
    }

    /// Returns the expert's next commands from the true state of the arm, rad/s; see [`expert::plan`].
    pub fn expert_plan(&self) -> [Joints; crate::CHUNK] {
        expert::plan(&self.servo, &self.goals[self.phase()])
    }

    /// Returns the result of the episode; meaningful after its end.
    pub fn result(&self) -> Outcome {
        let mean = |part: fn(&(f64, f64)) -> f64| self.held.iter().map(part).sum::<f64>() / GOALS as f64;
        Outcome {
            success: self.is_over()
                && self.held.iter().all(|&(distance, angle)| distance < POSITION_TOLERANCE && angle < AXIS_TOLERANCE),
            final_error_m: norm(self.error(self.phase()).position),
            tracking_error_m: mean(|held| held.0),
            axis_error_rad: mean(|held| held.1),
        }
    }

    /// Index of the current goal; the last one stays after the end.
    fn phase(&self) -> usize {
        (self.step / STEPS_PER_GOAL).min(GOALS - 1)
    }

    fn error(&self, phase: usize) -> PoseError {
        pose_error(&tool(&self.servo.angle), &self.goals[phase])
    }

    /// Draws the noise once for each step, so that observing twice gives the same values.
    fn sense(&mut self) {
        let error = self.error(self.phase());
        let groups: [&[f64]; 4] = [&self.servo.angle, &self.servo.velocity, &error.position, &error.rotation];
        let exact = groups.into_iter().zip(NOISE).flat_map(|(group, noise)| group.iter().map(move |&x| (x, noise)));
        for (value, (exact, noise)) in self.observation.iter_mut().zip(exact) {
            *value = (exact + noise * self.noise.normal()) as f32;
        }
    }
}

/// Runs the episode of `seed` with a policy from observation ([`OBS_DIM`] values) to joint velocity commands (rad/s).
/// The caller must first reset a policy with a state, such as a queue of actions.
pub fn run_episode<P: FnMut(&[f32]) -> [f32; 6]>(seed: u64, mut policy: P) -> Outcome {
    let mut task = Task::new(seed);
    while !task.is_over() {
        let action = policy(&task.observe());
        task.step(&action);
    }
    task.result()
}

/// Runs the episode of `seed` with the expert, which sees the state without noise.
pub fn run_expert(seed: u64) -> Outcome {
    let mut task = Task::new(seed);
    while !task.is_over() {
        let command = expert::command(&task.servo.angle, &task.goals[task.phase()]);
        task.step(&command.map(|x| x as f32));
    }
    task.result()
}

fn draw_posture(random: &mut Random) -> Joints {
    loop {
        let posture = core::array::from_fn(|i| HOME[i] + random.range(-POSTURE_RANGE[i], POSTURE_RANGE[i]));
        if tool(&posture).position[2] >= TABLE_CLEARANCE {
            return posture;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn expert_solves_the_task() {
        let solved = (0..100).filter(|&seed| run_expert(seed).success).count();
        assert!(solved >= 98, "{solved} of 100 episodes");
    }

    #[test]
    fn standing_still_fails() {
        assert!((0..20).all(|seed| !run_episode(seed, |_| [0.0; 6]).success));
    }

    #[test]
    fn episodes_are_deterministic() {
        let run = |seed| {
            let mut observations = Vec::new();
            let outcome = run_episode(seed, |obs| {
                observations.push(obs.to_vec());
                core::array::from_fn(|i| 0.3 * obs[12 + i] - 0.1 * obs[6 + i])
            });
            (observations, outcome)
        };
        assert_eq!(run(7), run(7));
        assert_ne!(run(7).0[0], run(8).0[0]);
        assert_eq!(run(7).0.len(), EPISODE_STEPS);
    }

    #[test]
    fn late_steps_and_nan_actions_are_harmless() {
        let mut task = Task::new(1);
        for _ in 0..EPISODE_STEPS + 5 {
            task.step(&[f32::NAN; 6]);
        }
        assert!(task.is_over());
        assert!(task.result().final_error_m.is_finite());
        assert!(!task.result().success);
    }
}
