//! Bundles of rl_sar, as its repository has them.

mod questions;
mod upstream;

use actq::error::{Result, ensure};
use actq_deploy::description::TargetKind;

use crate::common::made::{Files, refused};
use crate::common::onnx;
use upstream::{BASE, UPSTREAM, Upstream, WALK, raw};

const TICKS: usize = 25;
/// A line that older files do not have.
const PRIORITY: &str = "  observations_history_priority: \"time\"  # \"time\" or \"term\" priority\n";

/// The folder of the robot, with one policy.
pub(crate) fn robot(observation: usize) -> Files {
    Files::default()
        .with_file("base.yaml", BASE)
        .with_file("walk/config.yaml", WALK)
        .with_file("walk/policy.onnx", onnx::linear(observation, 4, &[]))
}

/// The folder of a policy of the older layout, without its robot.
fn alone() -> Files {
    Files::default().with_file("config.yaml", WALK).with_file("policy.onnx", onnx::linear(63, 4, &[]))
}

/// Runs a bundle; returns the same as [`Upstream::run`].
fn run(files: &Files, answers: &str) -> Result<Vec<Vec<f64>>> {
    let ticks = files.run(answers, TICKS, |name, _, tick| raw(name, tick))?;
    Ok(ticks.into_iter().map(|(observation, targets)| [observation, targets].concat()).collect())
}

/// Returns the largest difference; infinite if lengths differ.
fn difference(own: &[Vec<f64>], other: &[Vec<f64>]) -> f64 {
    let of = |(own, other): (&Vec<f64>, &Vec<f64>)| match own.len() == other.len() {
        true => own.iter().zip(other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max),
        false => f64::INFINITY,
    };
    own.iter().zip(other).map(of).fold(0.0, f64::max)
}

fn agrees(files: &Files, answers: &str, upstream: &Upstream) -> Result<()> {
    let difference = difference(&run(files, answers)?, &upstream.run(TICKS));
    ensure!(difference < 1e-5, "they differ by {difference}");
    Ok(())
}

#[test]
fn a_robot_with_wheels_agrees_with_the_deploy_code() -> Result<()> {
    let files = robot(63);
    agrees(&files, "", &UPSTREAM)?;
    let description = files.reading(true, "")?.description;
    let kinds: Vec<TargetKind> = description.targets.iter().map(|target| target.kind).collect();
    ensure!(kinds == [TargetKind::Position, TargetKind::Velocity], "{kinds:?}");
    ensure!((description.rate_hz - 50.0).abs() < 1e-9, "{}", description.rate_hz);
    ensure!(description.joints["policy_order"] == ["fl_leg", "fr_leg", "fl_foot", "fr_foot"], "{description:?}");
    // In the order of the motors, as the targets.
    let gains = description.gains.expect("gains");
    ensure!(gains.joints.as_deref() == Some("robot"), "{gains:?}");
    ensure!(gains.stiffness == [30.0, 0.0, 20.0, 0.0] && gains.damping == [0.6, 0.8, 0.5, 0.7], "{gains:?}");
    Ok(())
}

#[test]
fn every_layout_of_the_history_agrees() -> Result<()> {
    let with = |observation: usize, ids: &str, priority: &str| {
        let priority = format!("observations_history_priority: \"{priority}\"  #");
        robot(observation).with("[0, 1, 2]", ids).with("observations_history_priority: \"time\"  #", &priority)
    };
    let of =
        |ids: &'static [usize], is_term_priority| Upstream { observations_history: ids, is_term_priority, ..UPSTREAM };
    for (ids, list) in [("[0, 1, 2]", &[0, 1, 2][..]), ("[2, 1, 0]", &[2, 1, 0]), ("[0, 2, 4]", &[0, 2, 4])] {
        agrees(&with(63, ids, "time"), "", &of(list, false))?;
        agrees(&with(63, ids, "term"), "", &of(list, true))?;
    }
    for (ids, list) in [("[]", &[][..]), ("[0]", &[0])] {
        agrees(&with(21, ids, "term"), "", &of(list, true))?;
    }
    // Older files have no priority.
    let older = robot(63).with(PRIORITY, "");
    agrees(&older, "", &UPSTREAM)?;
    agrees(&older, "history.layout = \"term\"\n", &of(&[0, 1, 2], true))
}

/// A policy of all other terms, without limits of the action and without wheels.
const DANCE: &[(&str, &str)] = &[
    (
        "[\"ang_vel\", \"gravity_vec\", \"commands\", \"dof_pos\", \"dof_vel\", \"actions\"]",
        "[\"lin_vel\", \"phase\", \"g1_phase\", \"RoboMimic_Deploy/phase\", \"actions\", \"dof_pos\"]",
    ),
    ("[0, 1, 2]", "[]"),
    ("  clip_actions_lower: [-0.6, -0.5, -0.7, -0.6]\n  clip_actions_upper: [0.6, 0.65, 0.7, 0.8]\n", ""),
    ("wheel_indices: [2, 3]", "wheel_indices: []"),
    ("num_observations: 21", "num_observations: 20"),
];

fn dance() -> Files {
    DANCE.iter().fold(robot(20), |files, (from, to)| files.with(from, to))
}

const DANCES: Upstream = Upstream {
    observations: &["lin_vel", "phase", "g1_phase", "RoboMimic_Deploy/phase", "actions", "dof_pos"],
    observations_history: &[],
    clip_actions: None,
    wheel_indices: &[],
    ..UPSTREAM
};

#[test]
fn phases_agree_with_the_deploy_code() -> Result<()> {
    agrees(&dance(), "motion_length = 18.0\n", &DANCES)
}

#[test]
fn every_rule_alone_changes_the_result() -> Result<()> {
    let walk = robot(63);
    for answer in
        ["gravity = \"xyzw\"", "last_action = \"raw\"", "history.zero = \"oldest\"", "history.fill = \"first\""]
    {
        let difference = difference(&run(&walk, &format!("{answer}\n"))?, &UPSTREAM.run(TICKS));
        ensure!(difference > 1e-3, "{answer}: {difference}");
    }
    let dance = dance();
    let answers = [
        "lin_vel = \"input\"",
        "clock.when = \"after\"",
        "phase.period = 4.1",
        "g1_phase.period = 0.9",
        "motion_length = 17.0",
    ];
    for answer in answers {
        let length = if answer.starts_with("motion") { "" } else { "motion_length = 18.0" };
        let difference = difference(&run(&dance, &format!("{answer}\n{length}\n"))?, &DANCES.run(TICKS));
        ensure!(difference > 1e-4, "{answer}: {difference}");
    }
    Ok(())
}

#[test]
fn every_key_alone_changes_the_result() -> Result<()> {
    let edits = [
        ("\"ang_vel\", \"gravity_vec\"", "\"gravity_vec\", \"ang_vel\""),
        ("priority: \"time\"", "priority: \"term\""),
        ("[0, 1, 2]", "[2, 1, 0]"),
        ("clip_obs: 1.5", "clip_obs: 1.6"),
        ("lower: [-0.6, -0.5", "lower: [-0.6, 0.6"),
        ("upper: [0.6, 0.65", "upper: [0.6, 0.5"),
        ("action_scale: [0.25, 0.125", "action_scale: [0.125, 0.25"),
        ("wheel_indices: [2, 3]", "wheel_indices: [3]"),
        ("ang_vel_scale: 0.25", "ang_vel_scale: 0.2"),
        ("dof_pos_scale: 0.75", "dof_pos_scale: 0.7"),
        ("dof_vel_scale: 0.05", "dof_vel_scale: 0.04"),
        ("[2.0, 1.75, 0.25]", "[2.0, 0.25, 1.75]"),
        ("[0.8, -1.5, 0.1, 0.2]", "[0.8, -1.5, 0.1, 0.3]"),
        // The reverse.
        ("[2, 0, 3, 1]", "[1, 3, 0, 2]"),
    ];
    for (from, to) in edits {
        let difference = difference(&run(&robot(63).with(from, to), "")?, &UPSTREAM.run(TICKS));
        ensure!(difference > 1e-3, "{to}: {difference}");
    }
    Ok(())
}

/// A policy of the older layout: one file, numbers instead of lists, and both permutations.
#[test]
fn the_older_layout_agrees_with_its_deploy_code() -> Result<()> {
    let isaacgym = "dog_isaacgym:\n  framework: \"isaacgym\"\n  rows: 2\n  cols: 2\n  dt: 0.005\n  decimation: 4\n";
    let scale =
        "action_scale: 0.25\n  action_scale_wheel: 3.0\n  hip_scale_reduction: 0.5\n  hip_scale_reduction_indices: [1]";
    let mappings = "state_mapping: [2, 0, 3, 1]\n  command_mapping: [1, 3, 0, 2]";
    let older = alone()
        .with("dog/walk:\n", isaacgym)
        .with("action_scale: [0.25, 0.125, 5.0, 4.0]", scale)
        .with("joint_mapping: [2, 0, 3, 1]", mappings)
        .with(PRIORITY, "");
    let upstream =
        Upstream { action_scale: [0.25, 0.25, 3.0, 3.0], hip_scale_reduction: [1.0, 0.5, 1.0, 1.0], ..UPSTREAM };
    agrees(&older, "", &upstream)?;
    // Names without a permutation are in the order of the policy.
    let names = older.with(mappings, "joint_controller_names: [fl_leg, fr_leg, fl_foot, fr_foot]");
    agrees(&names, "", &Upstream { joint_mapping: [0, 1, 2, 3], ..upstream })?;
    for (from, to, expected) in [
        ("[1, 3, 0, 2]", "[2, 0, 3, 1]", "command_mapping says [2, 0, 3, 1], which is not its reverse"),
        ("\"isaacgym\"", "\"isaacsim\"", "transposes its lists by rows and cols"),
    ] {
        refused(to, older.with(from, to).reading(true, ""), expected)?;
    }
    Ok(())
}

/// A policy that moves some of the robot's joints: its targets have its own order.
#[test]
fn a_policy_may_move_some_joints() -> Result<()> {
    let files =
        robot(63).with("\"fl_foot\"]", "\"fl_foot\", \"arm\"]").with("\"fl_foot_c\"]", "\"fl_foot_c\", \"arm_c\"]");
    let description = files.reading(true, "")?.description;
    let orders: Vec<Option<&str>> = description.targets.iter().map(|target| target.joints.as_deref()).collect();
    ensure!(orders == [Some("policy_order"); 2], "{orders:?}");
    ensure!(description.gains.as_ref().is_some_and(|gains| gains.stiffness == [20.0, 30.0, 0.0, 0.0]), "gains");
    let plan = files.plan(&description);
    ensure!(plan.is_ok_and(|plan| plan.inputs().contains(&("dof_pos".to_owned(), 5))), "five joints are read");
    Ok(())
}
