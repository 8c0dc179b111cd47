//! A robot of Isaac Lab with four joints, in the form of both exports, and the arithmetic of its code.

/// The simulation's order of the joints.
pub(crate) const JOINTS: [&str; 4] = ["FL_hip", "FR_hip", "FL_knee", "FR_knee"];
/// Values of the observation without the term gait_phase.
pub(crate) const LEN: usize = 3 * 3 + 3 + 3 + 3 * 4 + 3 + 4;

/// `params/env.yaml` as a training writes it.
pub(crate) const ENVIRONMENT: &str = "\
viewer:
  eye: !!python/tuple
  - 7.5
  - 7.5
  - 7.5
  cam_prim_path: /OmniverseKit_Persp
sim:
  device: cuda:0
  dt: 0.005
  render_interval: 4
  gravity: !!python/tuple
  - 0.0
  - 0.0
  - -9.81
seed: 42
decimation: 4
scene:
  num_envs: 4096
  robot:
    class_type: isaaclab.assets.articulation.articulation:Articulation
    init_state:
      pos: !!python/tuple
      - 0.0
      - 0.0
      - 0.4
      joint_pos:
        .*L_hip: 0.1
        .*R_hip: -0.1
        FR_knee: -1.5
      joint_vel:
        .*: 0.0
    soft_joint_pos_limit_factor: 0.9
    actuators:
      legs:
        class_type: isaaclab.actuators.actuator_pd:DCMotor
        joint_names_expr:
        - .*_hip
        - .*_knee
        effort_limit: .inf
        stiffness:
          .*_hip: 25.0
          .*_knee: 30.0
        damping: 0.5
        armature: null
  terrain:
    class_type: isaaclab.terrains.terrain_importer:TerrainImporter
observations:
  policy:
    concatenate_terms: true
    enable_corruption: true
    concatenate_dim: -1
    history_length: null
    flatten_history_dim: true
    base_lin_vel: null
    base_ang_vel:
      func: isaaclab.envs.mdp.observations:base_ang_vel
      params: {}
      modifiers: null
      noise:
        func: isaaclab.utils.noise.noise_model:uniform_noise
        operation: add
        n_min: -0.2
        n_max: 0.2
      clip: !!python/tuple
      - -1.0
      - 1.0
      scale: 0.25
      history_length: 3
      flatten_history_dim: true
    projected_gravity:
      func: isaaclab.envs.mdp.observations:projected_gravity
      params: {}
      modifiers: null
      noise: null
      clip: null
      scale: null
      history_length: 0
      flatten_history_dim: true
    velocity_commands:
      func: isaaclab.envs.mdp.observations:generated_commands
      params:
        command_name: base_velocity
      modifiers: null
      noise: null
      clip: null
      scale: null
      history_length: 0
      flatten_history_dim: true
    joint_pos:
      func: isaaclab.envs.mdp.observations:joint_pos_rel
      params: {}
      modifiers: null
      noise: null
      clip: null
      scale: null
      history_length: 3
    joint_vel:
      func: isaaclab.envs.mdp.observations:joint_vel_rel
      params:
        asset_cfg:
          name: robot
          joint_names:
          - .*_knee
          - FR_hip
          joint_ids: !!python/object/apply:builtins.slice
          - null
          - null
          - null
          preserve_order: true
      modifiers: null
      noise: null
      clip: null
      scale: !!python/tuple
      - 0.05
      - 0.06
      - 0.07
      history_length: 0
      flatten_history_dim: true
    actions:
      func: isaaclab.envs.mdp.observations:last_action
      params: {}
      modifiers: null
      noise: null
      clip: null
      scale: null
      history_length: 0
      flatten_history_dim: true
    gait_phase:
      func: my_tasks.mdp.observations:gait_phase
      params:
        period: 0.8
      modifiers: null
      noise: null
      clip: null
      scale: null
      history_length: 0
      flatten_history_dim: true
  critic:
    concatenate_terms: true
    base_lin_vel:
      func: isaaclab.envs.mdp.observations:base_lin_vel
actions:
  joint_pos:
    class_type: isaaclab.envs.mdp.actions.joint_actions:JointPositionAction
    asset_name: robot
    debug_vis: false
    clip:
      .*: !!python/tuple
      - -2.0
      - 0.3
    joint_names:
    - FR_.*
    - FL_.*
    scale:
      .*_hip: 0.25
      .*_knee: 0.5
    offset: 0.0
    preserve_order: true
    use_default_offset: true
events:
  add_base_mass:
    func: isaaclab.envs.mdp.events:randomize_rigid_body_mass
    params:
      asset_cfg:
        name: robot
        body_ids: !!python/object/apply:builtins.slice
        - null
        - null
        - null
rewards:
  alive:
    func: isaaclab.envs.mdp.rewards:is_alive
    weight: 1.0
commands:
  base_velocity:
    class_type: isaaclab.envs.mdp.commands.velocity_command:UniformVelocityCommand
    ranges:
      lin_vel_x: !!python/tuple
      - -0.5
      - 0.5
      lin_vel_y: !!python/tuple
      - -0.5
      - 0.5
      ang_vel_z: !!python/tuple
      - -0.5
      - 0.5
";

/// The descriptors that the exporter makes of this environment. They lack gait_phase, whose function has none.
pub(crate) const DESCRIPTORS: &str = "\
actions:
- action_type: JointAction
  clip:
  - [-2.0, 0.30000001192092896]
  - [-2.0, 0.30000001192092896]
  - [-2.0, 0.30000001192092896]
  - [-2.0, 0.30000001192092896]
  dtype: torch.float32
  extras:
    description: Joint action term that applies the processed actions.
  full_path: isaaclab.envs.mdp.actions.joint_actions.JointPositionAction
  joint_names: [FR_hip, FR_knee, FL_hip, FL_knee]
  mdp_type: Action
  name: joint_position_action
  offset: [-0.1, -1.5, 0.1, 0.0]
  scale: [0.25, 0.5, 0.25, 0.5]
  shape: [4]
articulations:
  robot:
    joint_names: [FL_hip, FR_hip, FL_knee, FR_knee]
    default_joint_pos:
    - 0.1
    - -0.1
    - 0.0
    - -1.5
    default_joint_vel: [0.0, 0.0, 0.0, 0.0]
    default_joint_pos_limits: [[-1.0, 1.0], [-1.0, 1.0], [-3.0, 0.0], [-3.0, 0.0]]
    default_joint_stiffness: [25.0, 25.0, 30.0, 30.0]
    default_joint_damping: [0.5, 0.5, 0.5, 0.5]
    default_joint_friction: [0.0, 0.0, 0.0, 0.0]
    default_joint_armature: [0.0, 0.0, 0.0, 0.0]
observations:
  policy:
  - dtype: torch.float32
    extras: {axes: [X, Y, Z], description: Root angular velocity., modifiers: null, units: rad/s}
    full_path: isaaclab.envs.mdp.observations.base_ang_vel
    mdp_type: Observation
    name: base_ang_vel
    observation_type: RootState
    overloads: {clip: [-1.0, 1.0], flatten_history_dim: true, history_length: 3, scale: 0.25}
    shape: [3] # of base_ang_vel
  - dtype: torch.float32
    extras: {modifiers: null}
    full_path: isaaclab.envs.mdp.observations.projected_gravity
    mdp_type: Observation
    name: projected_gravity
    observation_type: RootState
    overloads: {clip: null, flatten_history_dim: true, history_length: 0, scale: null}
    shape: [3]
  - dtype: torch.float32
    extras: {modifiers: null}
    full_path: isaaclab.envs.mdp.observations.generated_commands
    mdp_type: Observation
    name: generated_commands
    observation_type: Command
    overloads: {clip: null, flatten_history_dim: true, history_length: 0, scale: null}
    shape: [3]
  - dtype: torch.float32
    extras: {modifiers: null}
    full_path: isaaclab.envs.mdp.observations.joint_pos_rel
    joint_names: [FL_hip, FR_hip, FL_knee, FR_knee]
    joint_pos_offsets: [0.1, -0.1, 0.0, -1.5]
    mdp_type: Observation
    name: joint_pos_rel
    observation_type: JointState
    overloads: {clip: null, flatten_history_dim: true, history_length: 3, scale: null}
    shape: [4]
  - dtype: torch.float32
    extras: {modifiers: null}
    full_path: isaaclab.envs.mdp.observations.joint_vel_rel
    joint_names: [FL_knee, FR_knee, FR_hip]
    joint_vel_offsets: [0.0, 0.0, 0.0]
    mdp_type: Observation
    name: joint_vel_rel
    observation_type: JointState
    overloads: {clip: null, flatten_history_dim: true, history_length: 0, scale: [0.05, 0.06, 0.07]}
    shape: [3]
  - dtype: torch.float32
    extras: {modifiers: null}
    full_path: isaaclab.envs.mdp.observations.last_action
    mdp_type: Observation
    name: last_action
    observation_type: Action
    overloads: {clip: null, flatten_history_dim: true, history_length: 0, scale: null}
    shape: [4]
scene:
  decimation: 4
  dt: 0.02
  physics_dt: 0.005
";

/// Returns a raw value of a tick.
pub(crate) fn raw(name: &str, len: usize, tick: usize) -> Vec<f64> {
    let seed = name.len() as f64;
    let value = |i: usize| (seed + 0.37 * tick as f64 + 1.3 * i as f64).sin();
    let size = match name {
        "base_ang_vel" => 6.0,
        "joint_vel" => 4.0,
        _ => 1.0,
    };
    // The command has another name in each file.
    let seed_free = |i: usize| (0.37 * tick as f64 + 1.3 * i as f64).cos();
    match name {
        "base_velocity" | "generated_commands" => (0..len).map(seed_free).collect(),
        _ => (0..len).map(|i| size * value(i)).collect(),
    }
}

/// Computes the network that the tests write.
pub(crate) fn network(observation: &[f64], actions: usize) -> Vec<f64> {
    let weight = |i: usize, j: usize| 0.01 * (1 + (i * actions + j) % 7) as f64;
    let sum = |j: usize| observation.iter().enumerate().map(|(i, value)| value * weight(i, j)).sum::<f64>();
    (0..actions).map(|j| 0.5 + sum(j)).collect()
}

/// Computes observations and targets of ticks as `ObservationManager.compute_group` and `JointAction.process_actions` do.
pub(crate) fn reference(gait: bool, ticks: usize) -> Vec<(Vec<f64>, Vec<f64>)> {
    let default = [0.1, -0.1, 0.0, -1.5];
    let (mut ang_vel, mut joint_pos): (Vec<Vec<f64>>, Vec<Vec<f64>>) = (Vec::new(), Vec::new());
    let mut last_action = vec![0.0; 4];
    let command = if gait { "base_velocity" } else { "generated_commands" };
    let mut all = Vec::new();
    for tick in 0..ticks {
        let append = |frames: &mut Vec<Vec<f64>>, frame: Vec<f64>| {
            if frames.is_empty() {
                *frames = vec![frame.clone(); 3];
            }
            frames.remove(0);
            frames.push(frame);
        };
        append(&mut ang_vel, raw("base_ang_vel", 3, tick).iter().map(|v| v.clamp(-1.0, 1.0) * 0.25).collect());
        append(&mut joint_pos, raw("joint_pos", 4, tick).iter().zip(default).map(|(q, q0)| q - q0).collect());
        let velocity = raw("joint_vel", 4, tick);
        let mut observation = ang_vel.concat();
        observation.extend(raw("projected_gravity", 3, tick));
        observation.extend(raw(command, 3, tick));
        observation.extend(joint_pos.concat());
        observation.extend([velocity[2] * 0.05, velocity[3] * 0.06, velocity[1] * 0.07]);
        observation.extend(&last_action);
        if gait {
            observation.extend(raw("gait_phase", 2, tick));
        }
        last_action = network(&observation, 4);
        // The action's joints: FR_hip, FR_knee, FL_hip, FL_knee.
        let (scale, offset) = ([0.25, 0.5, 0.25, 0.5], [-0.1, -1.5, 0.1, 0.0]);
        let target = (0..4).map(|i| (last_action[i] * scale[i] + offset[i]).clamp(-2.0, 0.3)).collect();
        all.push((observation, target));
    }
    all
}
