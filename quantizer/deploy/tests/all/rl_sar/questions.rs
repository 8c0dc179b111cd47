//! What is asked, and what is refused.

use actq::error::{Result, ensure};

use super::upstream::{BASE, UPSTREAM, Upstream, WALK};
use super::{DANCE, agrees, alone, dance, robot};
use crate::common::made::{message, refused};
use crate::common::onnx;

#[test]
fn rules_are_questions_until_accepted() -> Result<()> {
    assert_eq!(robot(63).asked(false, "")?, ["history.zero", "history.fill", "gravity", "last_action"]);
    let all = ["lin_vel", "phase.period", "clock.when", "g1_phase.period", "motion_length", "last_action"];
    assert_eq!(dance().asked(false, "")?, all);
    assert_eq!(dance().asked(true, "")?, ["motion_length"]);
    Ok(())
}

#[test]
fn the_application_computes_what_needs_a_motion() -> Result<()> {
    let terms = "[\"whole_body_tracking/motion_command\", \"whole_body_tracking/motion_anchor_ori_b\", \"ang_vel_world\", \"my/scan\"]";
    let files =
        robot(8 + 6 + 3 + 5).with(DANCE[0].0, terms).with("[0, 1, 2]", "[]").with("  num_observations: 21\n", "");
    assert_eq!(files.asked(true, "")?, ["raw.motion_command", "raw.motion_anchor_ori_b", "raw.ang_vel", "raw.scan"]);
    let answers = "raw = { motion_command = true, motion_anchor_ori_b = true, ang_vel = true, scan = SCAN }\n";
    let reading = files.reading(true, &answers.replace("SCAN", "5"))?;
    let inputs: Vec<(&str, Option<usize>)> =
        reading.description.inputs.iter().map(|input| (input.name.as_str(), input.len)).collect();
    let all = [("motion_command", 8), ("motion_anchor_ori_b", 6), ("ang_vel", 3), ("scan", 5)];
    ensure!(inputs == all.map(|(name, len)| (name, Some(len))), "{inputs:?}");
    files.plan(&reading.description)?;
    let error = message(files.reading(true, &answers.replace("SCAN", "4")));
    ensure!(error.contains("21 values") && error.contains("22 values"), "{error}");
    Ok(())
}

#[test]
fn one_of_several_policies_is_asked() -> Result<()> {
    let run = WALK.replace("dog/walk", "dog/run").replace("clip_obs: 1.5", "clip_obs: 9");
    let files = robot(63).with_file("run/config.yaml", run).with_file("run/policy.onnx", onnx::linear(63, 4, &[]));
    let questions = files.reading(true, "")?.questions;
    ensure!(questions.len() == 1 && questions[0].key == "config", "{questions:?}");
    ensure!(questions[0].meaning.contains("dog/run, dog/walk"), "{}", questions[0].meaning);
    agrees(&files, "config = \"dog/walk\"\n", &UPSTREAM)?;
    agrees(&files, "config = \"dog/run\"\n", &Upstream { clip_obs: 9.0, ..UPSTREAM })?;
    refused("an unknown policy", files.reading(true, "config = \"dog/sit\"\n"), "give one of dog/run, dog/walk")
}

#[test]
fn the_folder_of_a_policy_alone_lacks_its_robot() -> Result<()> {
    let expected = "config.yaml has no dt, which rl_sar reads from dog/base.yaml: name the folder dog";
    refused("no robot", alone().reading(true, ""), expected)?;
    // A file of the older layout has all keys.
    agrees(&alone().with_file("base.yaml", BASE), "", &UPSTREAM)
}

#[test]
fn torchscript_is_refused_with_its_export() -> Result<()> {
    let files = robot(63).with("policy.onnx", "it's.pt").with_file("walk/it's.pt", "PK");
    let error = message(files.reading(true, ""));
    for part in ["walk/config.yaml: dog/walk.model_name", "TorchScript", "torch.zeros(1, 63)", "'walk/it'\"'\"'s.onnx'"]
    {
        ensure!(error.contains(part), "{part:?} is not in: {error}");
    }
    // The exported file is read under the same name.
    agrees(&files.with_file("walk/it's.onnx", onnx::linear(63, 4, &[])), "", &UPSTREAM)
}

#[test]
fn bad_bundles_are_refused() -> Result<()> {
    let cases = [
        (
            "[0.8, -1.5, 0.1, 0.2]",
            "[0.8, -1.5]",
            "dog/walk.num_of_dofs says 4, and walk/config.yaml: dog/walk.default_dof_pos says 2 values",
        ),
        ("[20.0, 30.0, 0.0, 0.0]", "[20.0]", "rl_kp says 1 values"),
        ("[0.25, 0.125, 5.0, 4.0]", "[0.25]", "action_scale says 1 values"),
        ("lower: [-0.6, -0.5, -0.7, -0.6]", "lower: [-0.6]", "clip_actions_lower says 1 values"),
        ("[0.5, 0.6, 0.7, 0.8]", "[0.5, .nan, 0.7, 0.8]", "rl_kd (line 11) must be a list of finite numbers"),
        ("clip_obs: 1.5", "clip_obs: far", "dog/walk.clip_obs (line 7) must be a number from 0"),
        ("clip_obs: 1.5", "clip_obs: -1", "clip_obs (line 7) must be a number from 0"),
        ("  ang_vel_scale: 0.25\n", "", "walk/config.yaml: dog/walk.ang_vel_scale is missing"),
        ("  clip_obs: 1.5\n", "  clip_obs: 1.5\n  observations: []\n", "key \"observations\" occurs twice"),
        ("\"dof_vel\"", "\"dof_pos\"", "\"dof_pos\" occurs twice"),
        ("\"dof_vel\"", "\"dof\\e[2J\"", "term 4 (from 0) is not a name"),
        (
            "num_observations: 21",
            "num_observations: 20",
            "num_observations says 20, and walk/config.yaml: dog/walk.observations says terms of 21 values",
        ),
        ("upper: [0.6, 0.65, 0.7, 0.8]", "upper: [0.6, -0.65, 0.7, 0.8]", "limits of action 1 (from 0)"),
        ("  clip_actions_upper: [0.6, 0.65, 0.7, 0.8]\n", "", "clip_actions_lower is there without clip_actions_upper"),
        ("[2, 0, 3, 1]", "[2, 0, 2, 1]", "joint_mapping: joint 2 occurs twice"),
        (
            "[2, 0, 3, 1]",
            "[2, 0, 4, 1]",
            "joint 2 of the policy is joint 4 of the robot, and base.yaml: dog.joint_names says 4 joints",
        ),
        ("[2, 0, 3, 1]", "[2, 0, 2.5, 1]", "joint_mapping (line 24) must be a list of joints' numbers"),
        ("wheel_indices: [2, 3]", "wheel_indices: [4]", "wheel_indices: there is no joint 4"),
        ("wheel_indices: [2, 3]", "wheel_indices: [3, 3]", "wheel_indices: joint 3 occurs twice"),
        ("[0, 1, 2]", "[0, 1, 3]", "only numbers in equal steps"),
        ("[0, 1, 2]", "[1, 2, 3]", "only numbers in equal steps"),
        ("priority: \"time\"", "priority: \"env\"", "must be \"time\" or \"term\""),
        (
            "  rl_kp",
            "  joint_names: [fl_leg]\n  rl_kp",
            "dog/walk.joint_names says joint 0 (from 0) is \"fl_leg\", and base.yaml: dog.joint_names says joint 0 (from 0) is \"fr_leg\"",
        ),
        ("\"fr_foot\"", "\"fr_leg\"", "dog.joint_names: \"fr_leg\" occurs twice"),
        ("\"fr_foot\"", "\"fr\\u202e\"", "is not a name"),
        ("dt: 0.005", "dt: 0", "base.yaml: dog.dt (line 2) must be a number above 0"),
        ("num_of_dofs: 4\n  action", "num_of_dofs: 0\n  action", "num_of_dofs is 0"),
        ("\"policy.onnx\"", "\"../../policy.onnx\"", "there is no \"walk/../../policy.onnx\" in the bundle"),
        ("\"policy.onnx\"", "\"/etc/passwd\"", "has no ending"),
        ("\"policy.onnx\"", "\"policy\"", "\"policy\" has no ending"),
        ("  rl_kp", "  use_pmtg_controller: true\n  rl_kp", "PMTG is not supported"),
        ("dt: 0.005", "dt: [0.005", "not YAML"),
    ];
    for (from, to, expected) in cases {
        refused(&format!("{from} -> {to}"), robot(63).with(from, to).reading(true, ""), expected)?;
    }
    let expected = "observations says 63 values, and walk/policy.onnx: actor_obs says 64 values";
    refused("another network", robot(64).reading(true, ""), expected)
}
