//! Bundles of humanoidverse's sim2real code: FALCON and ASAP.

use actq::error::Result;
use actq_deploy::{Answers, Bundle, read};

use crate::common::made::{Files, Tick, agrees, asked, refused, shared};
use crate::common::onnx;

const ANSWERS: &str = "action_scale = 0.25\nrate_hz = 50\n";

#[test]
fn falcon_agrees_with_its_deploy_code() -> Result<()> {
    agrees("falcon_g1", "expect.npz", ANSWERS)
}

#[test]
fn every_rule_of_falcon_is_a_question() -> Result<()> {
    let Some(folder) = shared("falcon_g1") else { return Ok(()) };
    let bundle = Bundle::open(&folder.join("bundle"))?;
    let unanswered = read(&bundle, false, Answers::default())?;
    let mut all = asked(&unanswered);
    all.sort_unstable();
    let expected = [
        "action.clip",
        "action_scale",
        "gravity.unitree",
        "history.fill",
        "history.first",
        "history.layout",
        "joint_order",
        "last_action",
        "rate_hz",
        "residual",
        "target.clip",
        "terms.order",
    ];
    assert_eq!(all, expected);
    let accepted = read(&bundle, true, Answers::default())?;
    assert_eq!(asked(&accepted), ["rate_hz", "action_scale"], "what differs between policies");
    Ok(())
}

/// A robot with three joints, the last of which is the upper body.
pub(crate) const ROBOT: &str = "\
DEFAULT_DOF_ANGLES: [0.1, 0.2, 0.3]
NUM_JOINTS: 3
NUM_UPPER_BODY_JOINTS: 1
motor_pos_lower_limit_list: [-9, -9, -9]
motor_pos_upper_limit_list: [9, 9, 9]
obs_scales: {actions: 1.0, base_ang_vel: 1.0, command_stand: 1.0, cos_phase: 1.0, dof_pos: 1.0, dof_vel: 1.0,
  projected_gravity: 1.0, ref_motion_phase: 1.0, ref_upper_dof_pos: 1.0, history_loco: 1.0, history_mimic: 1.0}
";

pub(crate) const FALCON: &str = "
obs_dict: {actor_obs: [dof_pos, cos_phase, actions, command_stand]}
history_length_dict: {actor_obs: 2}
obs_dims: {dof_pos: 3, cos_phase: 1, actions: 2, command_stand: 1}
GAIT_PERIOD: 0.5
";

const ASAP: &str = "
USE_HISTORY_LOCO: True
USE_HISTORY_MIMIC: True
history_loco_config: {actions: 1, dof_pos: 1}
history_mimic_config: {base_ang_vel: 2, projected_gravity: 2, dof_pos: 2, dof_vel: 2, actions: 2, ref_motion_phase: 2}
obs_dims: {}
obs_loco_dims: {actions: 2, dof_pos: 3}
obs_mimic_dims: {base_ang_vel: 3, projected_gravity: 3, dof_pos: 3, dof_vel: 3, actions: 3, ref_motion_phase: 1}
robot_dofs: {all: [1, 1, 1], two: [1, 0, 1]}
mimic_robot_types: {jump: two, kick: all}
mimic_models: {jump: model.onnx, kick: model.onnx}
motion_length_s: {jump: 2.0, kick: 3.0}
";

/// The bundle of a YAML file and networks.
pub(crate) fn files(yaml: &str, networks: &[(&str, Vec<u8>)]) -> Files {
    let robot = Files::default().with_file("robot.yaml", yaml);
    networks.iter().fold(robot, |files, (name, network)| files.with_file(name, network.clone()))
}

/// Runs a bundle; each raw value is `raw(name, tick)`.
fn run(yaml: &str, network: (&str, Vec<u8>), raw: fn(&str, usize) -> Vec<f64>, ticks: usize) -> Result<Vec<Tick>> {
    files(yaml, &[network]).run(ANSWERS, ticks, |name, _, tick| raw(name, tick))
}

fn raw(name: &str, tick: usize) -> Vec<f64> {
    let tick = tick as f64;
    match name {
        "dof_pos" => vec![1.1 + tick, 2.2 + tick, 3.3 + tick],
        "dof_vel" => vec![0.5, 0.6, 0.7],
        "base_quat" => vec![1.0, 0.0, 0.0, 0.0],
        "base_ang_vel" => vec![0.0; 3],
        "command_stand" => vec![if tick < 2.0 { 0.0 } else { 1.0 }],
        _ => vec![0.25],
    }
}

#[track_caller]
fn near(values: &[f64], expected: &[f64]) {
    let same = values.iter().zip(expected).all(|(value, expected)| (value - expected).abs() < 1e-6);
    assert!(same && values.len() == expected.len(), "{values:?}, not {expected:?}");
}

#[test]
fn a_policy_of_the_lower_body_gets_its_phase() -> Result<()> {
    let ticks = run(&format!("{ROBOT}{FALCON}"), ("policy.onnx", onnx::linear(14, 2, &[])), raw, 4)?;
    // A frame has actions 2, command_stand, cos_phase and dof_pos 3; the newest is the last.
    near(&ticks[0].0[..7], &[0.0; 7]);
    near(&ticks[0].0[9..], &[0.0, 1.0, 1.0, 2.0, 3.0]);
    near(&ticks[1].0[..7], &ticks[0].0[7..]);
    near(&ticks[3].0[9..11], &[1.0, (std::f64::consts::TAU * 3.0 / 25.0).cos()]);
    let action = ticks[1].0[7..9].to_vec();
    near(&ticks[0].1, &[0.1 + 0.25 * action[0], 0.2 + 0.25 * action[1], 0.3 + 0.25]);
    Ok(())
}

#[test]
fn asap_reads_past_frames_newest_first() -> Result<()> {
    let yaml = format!("{ROBOT}{ASAP}");
    let ticks = run(&yaml, ("loco/policy.onnx", onnx::linear(10, 2, &[])), raw, 2)?;
    near(&ticks[0].0, &[0.0, 0.0, 1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    near(&ticks[1].0[2..5], &[2.0, 3.0, 4.0]);
    near(&ticks[1].0[5..], &[0.0, 0.0, 1.0, 2.0, 3.0]);

    let ticks = run(&yaml, ("mimic/jump/model.onnx", onnx::linear(39, 2, &[])), raw, 3)?;
    near(&ticks[0].0[5..9], &[1.0, 3.0, 0.5, 0.7]);
    near(&ticks[0].0[9..35], &[0.0; 26]);
    near(&ticks[2].0[19..23], &[2.0, 4.0, 1.0, 3.0]);
    near(&ticks[2].0[33..], &[0.01, 0.0, 0.0, 0.0, -1.0, 0.02]);
    near(&ticks[0].1[1..2], &[0.2]);
    assert!((ticks[0].1[2] - 0.3).abs() > 1e-3, "the policy moves the last joint");
    Ok(())
}

#[test]
fn bad_files_are_refused() -> Result<()> {
    let falcon = || format!("{ROBOT}{FALCON}");
    let policy = || vec![("policy.onnx", onnx::linear(14, 2, &[]))];
    let cases = [
        ("no network", falcon(), Vec::new(), "there is no ONNX file"),
        ("no terms", format!("{ROBOT}obs_dims: {{}}\n"), policy(), "neither obs_dict (FALCON) nor"),
        ("a joint more", falcon().replace("NUM_JOINTS: 3", "NUM_JOINTS: 4"), policy(), "contradicts itself"),
        ("NaN", falcon().replace("0.2,", ".nan,"), policy(), "DEFAULT_DOF_ANGLES (line 1) must be a list of finite"),
        ("a limit less", falcon().replace("[9, 9, 9]", "[9, 9]"), policy(), "upper_limit_list has 2 values"),
        ("another action", falcon().replace("actions: 2", "actions: 3"), policy(), "length of actions"),
        ("another pose", falcon().replace("dof_pos: 3,", "dof_pos: 2,"), policy(), "length of dof_pos"),
        ("no scale", falcon().replace("cos_phase: 1.0, ", ""), policy(), "obs_scales.cos_phase is missing"),
        ("a longer history", falcon().replace("actor_obs: 2", "actor_obs: 3"), policy(), "length of the observation"),
        ("no history", falcon().replace("actor_obs: 2", "actor_obs: 0"), policy(), "must be a number of frames"),
        ("a period of 0", falcon().replace("PERIOD: 0.5", "PERIOD: 0"), policy(), "GAIT_PERIOD = 0: give a number"),
        ("a term twice", falcon().replace("[dof_pos,", "[actions, dof_pos,"), policy(), "\"actions\" occurs twice"),
        (
            "two upper bodies",
            falcon() + "dof_names: [a, b, c]\ndof_names_upper_body: [b, c]\n",
            policy(),
            "joints of the upper body",
        ),
        ("a name twice", falcon() + "dof_names: [a, b, b]\n", policy(), "occurs twice"),
        (
            "another SDK",
            falcon()
                .replace("[dof_pos, cos_phase", "[dof_pos, projected_gravity")
                .replace(" cos_phase: 1,", " projected_gravity: 3,")
                + "SDK_TYPE: xyz\n",
            policy(),
            "\"xyz\" is unknown; use unitree or booster",
        ),
        ("a merge", falcon() + "<<: {a: 1}\n", policy(), "it merges another map (<<), which is not supported"),
        ("a key twice", falcon() + "GAIT_PERIOD: 1\n", policy(), "occurs twice"),
        ("a longer action", falcon(), vec![("policy.onnx", onnx::linear(14, 4, &[]))], "contradicts itself"),
    ];
    for (name, yaml, networks, expected) in cases {
        refused(name, files(&yaml, &networks).reading(true, ANSWERS), expected)?;
    }
    Ok(())
}

#[test]
fn what_nothing_states_is_a_question() -> Result<()> {
    let unknown = format!("{ROBOT}{FALCON}").replace("cos_phase", "dif_pose");
    let policy = || ("policy.onnx", onnx::linear(14, 2, &[]));
    let moved = format!("{ROBOT}{FALCON}JOINT2MOTOR: [1, 0, 2]\n");
    let several = vec![policy(), ("other.onnx", onnx::linear(14, 2, &[]))];
    for (yaml, networks, expected) in [
        (unknown, vec![policy()], "raw.dif_pose"),
        (moved, vec![policy()], "raw.joints"),
        (format!("{ROBOT}{FALCON}"), several, "network"),
    ] {
        assert_eq!(files(&yaml, &networks).asked(true, ANSWERS)?, [expected]);
    }
    Ok(())
}
