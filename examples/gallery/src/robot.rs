//! A robot with its task, episode after episode.

use actq_balancer as balancer;
use actq_ur3::kinematics::{chain, norm, subtract, tool};
use actq_ur3::task as arm;

enum Task {
    Balancer(Box<balancer::Task>),
    Arm(Box<arm::Task>),
}

/// A robot with its task.
pub struct Robot {
    task: Task,
    seed: u64,
    /// The balancer's distance along its track, m, which its task does not need.
    travelled: f64,
    /// The goal that [`Self::aim`] has set.
    aimed: Option<[f64; 3]>,
    /// Values that the policy observes.
    pub observation: Vec<f32>,
    /// The policy's action.
    pub action: Vec<f32>,
    /// Values to draw: of the balancer, distance (m), lean and heading (rad), speed, turn rate and their commands; of the
    /// arm, the positions of base, joints and tool (x, y, z each, m), then that of the goal.
    pub view: Vec<f64>,
    /// Error of the task: of the balancer's speed, m/s, or of the arm's tool, m.
    pub error: f64,
    /// Episodes that ended, and those with success.
    pub episodes: [u32; 2],
}

impl Robot {
    /// Begins the episodes of a robot, 0 for the balancer and 1 for the arm, from a seed on.
    pub fn new(which: u32, seed: u64) -> Self {
        let task = begin(which, seed);
        let lengths = match task {
            Task::Balancer(_) => [balancer::RAW_LEN, 2],
            Task::Arm(_) => [actq_ur3::OBS_DIM, actq_ur3::ACT_DIM],
        };
        let [observation, action] = lengths.map(|len| vec![0.0; len]);
        let (view, error) = (Vec::new(), 0.0);
        let mut robot =
            Self { task, seed, travelled: 0.0, aimed: None, observation, action, view, error, episodes: [0; 2] };
        robot.sense();
        robot
    }

    /// Applies the action for one control step. Returns `true` if a new episode begins: then the policy must be reset.
    pub fn step(&mut self) -> bool {
        let success = match &mut self.task {
            Task::Balancer(task) => {
                let torques = [0, 1].map(|i| f64::from(self.action[i]));
                task.apply(torques);
                self.travelled += task.truth().0.speed / balancer::RATE_HZ as f64;
                task.is_over().then(|| task.outcome().success)
            }
            Task::Arm(task) => {
                let mut action = [0.0; actq_ur3::ACT_DIM];
                action.copy_from_slice(&self.action);
                task.step(&action);
                task.is_over().then(|| task.result().success)
            }
        };
        if let Some(success) = success {
            self.episodes[0] += 1;
            self.episodes[1] += u32::from(success);
            self.seed += 1;
            self.travelled = 0.0;
            self.task = begin(u32::from(matches!(self.task, Task::Arm(_))), self.seed);
        }
        if let Some(goal) = self.aimed {
            self.aim(goal);
        }
        self.sense();
        success.is_some()
    }

    /// Pushes the balancer with a force in N, or the arm's first joint with an acceleration in rad/s².
    pub fn push(&mut self, strength: f64) {
        match &mut self.task {
            Task::Balancer(task) => task.push(strength),
            Task::Arm(task) => task.push(0, strength),
        }
    }

    /// Sets the goal from now on: the balancer's speed and turn rate, or the position of the arm's tool.
    pub fn aim(&mut self, goal: [f64; 3]) {
        self.aimed = Some(goal);
        match &mut self.task {
            Task::Balancer(task) => task.command([goal[0], goal[1]]),
            Task::Arm(task) => task.move_goal(goal),
        }
    }

    fn sense(&mut self) {
        match &mut self.task {
            Task::Balancer(task) => {
                self.observation.copy_from_slice(&task.sense());
                let (state, [speed, turn]) = task.truth();
                self.view = vec![self.travelled, state.pitch, state.yaw, state.speed, state.yaw_rate, speed, turn];
                self.error = (state.speed - speed).abs();
            }
            Task::Arm(task) => {
                self.observation.copy_from_slice(&task.observe());
                let goal = task.goal().position;
                let frames = chain(task.joints());
                self.view = frames.iter().flat_map(|frame| frame.position).chain(goal).collect();
                self.error = norm(subtract(tool(task.joints()).position, goal));
            }
        }
    }
}

fn begin(which: u32, seed: u64) -> Task {
    match which {
        0 => Task::Balancer(Box::new(balancer::Task::new(seed))),
        _ => Task::Arm(Box::new(arm::Task::new(seed))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_robot_without_a_policy_fails_and_begins_again() {
        for which in [0, 1] {
            let mut robot = Robot::new(which, 1);
            let steps = (0..2000).find(|_| robot.step()).expect("an episode ends");
            assert!(steps > 10 && robot.episodes == [1, 0] && robot.view.iter().all(|value| value.is_finite()));
        }
    }
}
