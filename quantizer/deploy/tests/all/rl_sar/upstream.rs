//! A robot of rl_sar, and what its deploy code computes.

/// The robot: two legs and two wheels, in the order of its motors.
pub(crate) const BASE: &str = "\
dog:
  dt: 0.005
  decimation: 4
  num_of_dofs: 4
  wheel_indices: [1, 3]
  fixed_kp: [80.0, 0.0, 80.0, 0.0]
  fixed_kd: [3.0, 1.0, 3.0, 1.0]
  torque_limits: [23.5, 23.5, 23.5, 23.5]
  default_dof_pos: [0.0, 0.0, 0.0, 0.0]
  joint_names: [\"fr_leg\", \"fr_foot\", \"fl_leg\", \"fl_foot\"]
  joint_controller_names: [\"fr_leg_c\", \"fr_foot_c\", \"fl_leg_c\", \"fl_foot_c\"]
  joint_mapping: [0, 1, 2, 3]
";

/// A policy: the left leg, the right leg, the left wheel, the right wheel.
pub(crate) const WALK: &str = "\
dog/walk:
  model_name: \"policy.onnx\"
  num_observations: 21
  observations: [\"ang_vel\", \"gravity_vec\", \"commands\", \"dof_pos\", \"dof_vel\", \"actions\"]
  observations_history: [0, 1, 2]  # 0 is the latest observation
  observations_history_priority: \"time\"  # \"time\" or \"term\" priority
  clip_obs: 1.5
  clip_actions_lower: [-0.6, -0.5, -0.7, -0.6]
  clip_actions_upper: [0.6, 0.65, 0.7, 0.8]
  rl_kp: [20.0, 30.0, 0.0, 0.0]
  rl_kd: [0.5, 0.6, 0.7, 0.8]
  fixed_kp: [70.0, 70.0, 0.0, 0.0]
  fixed_kd: [5.0, 5.0, 0.5, 0.5]
  num_of_dofs: 4
  action_scale: [0.25, 0.125, 5.0, 4.0]
  wheel_indices: [2, 3]
  lin_vel_scale: 2.0
  ang_vel_scale: 0.25
  dof_pos_scale: 0.75
  dof_vel_scale: 0.05
  commands_scale: [2.0, 1.75, 0.25]
  torque_limits: [23.5, 23.5, 23.5, 23.5]
  default_dof_pos: [0.8, -1.5, 0.1, 0.2]
  joint_mapping: [2, 0, 3, 1]
";

/// Raw values that reach the limits; those of joints in the order of the motors.
pub(crate) fn raw(name: &str, tick: usize) -> Vec<f64> {
    let at = |i: usize, size: f64| size * (0.37 * tick as f64 + 1.3 * i as f64 + 0.2).sin();
    match name {
        "ang_vel" => (0..3).map(|i| at(i, 8.0)).collect(),
        "lin_vel" | "commands" => (0..3).map(|i| at(i + 3, 1.2)).collect(),
        "dof_pos" => (0..4).map(|i| at(i + 6, 1.6)).collect(),
        "dof_vel" => (0..4).map(|i| at(i + 10, 20.0)).collect(),
        "base_quat" => {
            let quat: Vec<f64> = (0..4).map(|i| at(i + 14, 1.0)).collect();
            let norm = quat.iter().map(|q| q * q).sum::<f64>().sqrt();
            quat.iter().map(|q| q / norm).collect()
        }
        "projected_gravity" => vec![0.1, 0.2, -0.9],
        _ => vec![0.5; 8],
    }
}

/// The deploy code's arithmetic, in its words.
pub(crate) struct Upstream {
    pub(crate) observations: &'static [&'static str],
    pub(crate) observations_history: &'static [usize],
    pub(crate) is_term_priority: bool,
    pub(crate) clip_obs: f64,
    pub(crate) clip_actions: Option<[[f64; 4]; 2]>,
    pub(crate) action_scale: [f64; 4],
    pub(crate) hip_scale_reduction: [f64; 4],
    pub(crate) wheel_indices: &'static [usize],
    pub(crate) default_dof_pos: [f64; 4],
    pub(crate) joint_mapping: [usize; 4],
    pub(crate) motion_length: f64,
}

pub(crate) const UPSTREAM: Upstream = Upstream {
    observations: &["ang_vel", "gravity_vec", "commands", "dof_pos", "dof_vel", "actions"],
    observations_history: &[0, 1, 2],
    is_term_priority: false,
    clip_obs: 1.5,
    clip_actions: Some([[-0.6, -0.5, -0.7, -0.6], [0.6, 0.65, 0.7, 0.8]]),
    action_scale: [0.25, 0.125, 5.0, 4.0],
    hip_scale_reduction: [1.0; 4],
    wheel_indices: &[2, 3],
    default_dof_pos: [0.8, -1.5, 0.1, 0.2],
    joint_mapping: [2, 0, 3, 1],
    motion_length: 18.0,
};

/// Rotates a vector of the world into the frame of a quaternion, its real part first.
fn quat_rotate_inverse(q: &[f64], v: [f64; 3]) -> Vec<f64> {
    let (w, u) = (q[0], [q[1], q[2], q[3]]);
    let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let dot: f64 = (0..3).map(|i| u[i] * v[i]).sum();
    (0..3).map(|i| v[i] * (2.0 * w * w - 1.0) - cross[i] * w * 2.0 + u[i] * dot * 2.0).collect()
}

impl Upstream {
    fn compute_observation(&self, step: usize, actions: &[f64; 4]) -> Vec<Vec<f64>> {
        let tick = step - 1;
        let time = step as f64 * 0.005 * 4.0;
        let joints = |name: &str| self.joint_mapping.map(|motor| raw(name, tick)[motor]);
        let scaled = |values: &[f64], by: f64| values.iter().map(|value| value * by).collect::<Vec<_>>();
        let term = |name: &&str| match *name {
            "lin_vel" => vec![0.0; 3],
            "ang_vel" => scaled(&raw("ang_vel", tick), 0.25),
            "gravity_vec" => quat_rotate_inverse(&raw("base_quat", tick), [0.0, 0.0, -1.0]),
            "commands" => raw("commands", tick).iter().zip([2.0, 1.75, 0.25]).map(|(c, scale)| c * scale).collect(),
            "dof_pos" => {
                let mut dof_pos_rel = joints("dof_pos");
                (0..4).for_each(|i| dof_pos_rel[i] -= self.default_dof_pos[i]);
                self.wheel_indices.iter().for_each(|wheel| dof_pos_rel[*wheel] = 0.0);
                scaled(&dof_pos_rel, 0.75)
            }
            "dof_vel" => scaled(&joints("dof_vel"), 0.05),
            "actions" => actions.to_vec(),
            "phase" => {
                let phase = std::f64::consts::PI * time / 2.0;
                [phase, phase / 2.0, phase / 4.0].iter().flat_map(|phase| [phase.sin(), phase.cos()]).collect()
            }
            "g1_phase" => {
                let phase = std::f64::consts::TAU * ((time % 0.8) / 0.8);
                vec![phase.sin(), phase.cos()]
            }
            "RoboMimic_Deploy/phase" => vec![time / self.motion_length],
            _ => Vec::new(),
        };
        let clamped = |term: Vec<f64>| term.iter().map(|v| v.clamp(-self.clip_obs, self.clip_obs)).collect();
        self.observations.iter().map(term).map(clamped).collect()
    }

    /// Returns the observation, then positions and velocities in the order of the motors, for each tick.
    pub(crate) fn run(&self, ticks: usize) -> Vec<Vec<f64>> {
        let mut actions = [0.0; 4];
        let zeros: Vec<Vec<f64>> =
            self.compute_observation(1, &actions).iter().map(|term| vec![0.0; term.len()]).collect();
        // The newest first.
        let mut obs_buf = vec![zeros; self.observations_history.iter().max().map_or(1, |last| last + 1)];
        let mut all = Vec::new();
        for step in 1..=ticks {
            obs_buf.rotate_right(1);
            obs_buf[0] = self.compute_observation(step, &actions);
            let obs: Vec<f64> = match self.observations_history {
                [] => obs_buf[0].concat(),
                ids if self.is_term_priority => (0..self.observations.len())
                    .flat_map(|term| ids.iter().flat_map(|id| obs_buf[*id][term].clone()).collect::<Vec<_>>())
                    .collect(),
                ids => ids.iter().flat_map(|id| obs_buf[*id].concat()).collect(),
            };
            // The network that `onnx::linear` makes.
            actions = [0, 1, 2, 3].map(|o| {
                let weight = |i: usize| 0.01 * (1 + (i * 4 + o) % 7) as f64;
                0.5 + obs.iter().enumerate().map(|(i, value)| value * weight(i)).sum::<f64>()
            });
            for i in 0..4 {
                if let Some([low, high]) = self.clip_actions {
                    actions[i] = actions[i].clamp(low[i], high[i]);
                }
                actions[i] *= self.hip_scale_reduction[i];
            }
            let (mut pos, mut vel) = ([0.0; 4], [0.0; 4]);
            for i in 0..4 {
                let scaled = actions[i] * self.action_scale[i];
                let is_wheel = self.wheel_indices.contains(&i);
                pos[self.joint_mapping[i]] = if is_wheel { 0.0 } else { scaled } + self.default_dof_pos[i];
                vel[self.joint_mapping[i]] = if is_wheel { scaled } else { 0.0 };
            }
            let wheels = if self.wheel_indices.is_empty() { Vec::new() } else { vel.to_vec() };
            all.push([obs, pos.to_vec(), wheels].concat());
        }
        all
    }
}
