//! What is asked, and what is refused.

use actq::error::{Result, ensure};
use actq_deploy::{Answers, Plan, read};

use super::upstream::{BASE, UPSTREAM, Upstream, WALK};
use super::{DANCE, agrees, edited, reading, robot};
use crate::common::made::{Made, message, refused};
use crate::common::onnx;

#[test]
fn rules_are_questions_until_accepted() -> Result<()> {
    let asked = |made: &Made, accepted: bool| -> Result<Vec<String>> {
        let reading = read(&made.bundle()?, accepted, Answers::default())?;
        Ok(reading.questions.into_iter().map(|question| question.key).collect())
    };
    let walk = robot(BASE, WALK, 63)?;
    ensure!(
        asked(&walk, false)? == ["history.zero", "history.fill", "gravity", "last_action"],
        "{:?}",
        asked(&walk, false)?
    );
    let dance = robot(BASE, &edited(WALK, DANCE), 20)?;
    let all = ["lin_vel", "phase.period", "clock.when", "g1_phase.period", "motion_length", "last_action"];
    ensure!(asked(&dance, false)? == all, "{:?}", asked(&dance, false)?);
    ensure!(asked(&dance, true)? == ["motion_length"], "{:?}", asked(&dance, true)?);
    Ok(())
}

#[test]
fn the_application_computes_what_needs_a_motion() -> Result<()> {
    let terms = "[\"whole_body_tracking/motion_command\", \"whole_body_tracking/motion_anchor_ori_b\", \"ang_vel_world\", \"my/scan\"]";
    let edits = [(DANCE[0].0, terms), ("[0, 1, 2]", "[]"), ("  num_observations: 21\n", "")];
    let made = robot(BASE, &edited(WALK, &edits), 8 + 6 + 3 + 5)?;
    let questions = reading(&made, "")?.questions;
    let asked: Vec<&str> = questions.iter().map(|question| question.key.as_str()).collect();
    ensure!(asked == ["raw.motion_command", "raw.motion_anchor_ori_b", "raw.ang_vel", "raw.scan"], "{asked:?}");
    let answers = "raw = { motion_command = true, motion_anchor_ori_b = true, ang_vel = true, scan = SCAN }\n";
    let reading = reading(&made, &answers.replace("SCAN", "5"))?;
    let inputs: Vec<(&str, Option<usize>)> =
        reading.description.inputs.iter().map(|input| (input.name.as_str(), input.len)).collect();
    let all = [("motion_command", 8), ("motion_anchor_ori_b", 6), ("ang_vel", 3), ("scan", 5)];
    ensure!(inputs == all.map(|(name, len)| (name, Some(len))), "{inputs:?}");
    Plan::new(&reading.description, &made.bundle()?)?;
    let error = message(super::reading(&made, &answers.replace("SCAN", "4")));
    ensure!(error.contains("21 values") && error.contains("22 values"), "{error}");
    Ok(())
}

#[test]
fn one_of_several_policies_is_asked() -> Result<()> {
    let made = robot(BASE, WALK, 63)?;
    made.write(
        "run/config.yaml",
        edited(WALK, &[("dog/walk", "dog/run"), ("clip_obs: 1.5", "clip_obs: 9")]).as_bytes(),
    )?;
    made.write("run/policy.onnx", &onnx::linear(63, 4, &[]))?;
    let questions = reading(&made, "")?.questions;
    ensure!(questions.len() == 1 && questions[0].key == "config", "{questions:?}");
    ensure!(questions[0].meaning.contains("dog/run, dog/walk"), "{}", questions[0].meaning);
    agrees(&made, "config = \"dog/walk\"\n", &UPSTREAM)?;
    agrees(&made, "config = \"dog/run\"\n", &Upstream { clip_obs: 9.0, ..UPSTREAM })?;
    let error = message(reading(&made, "config = \"dog/sit\"\n"));
    ensure!(error.contains("give one of dog/run, dog/walk"), "{error}");
    Ok(())
}

#[test]
fn the_folder_of_a_policy_alone_lacks_its_robot() -> Result<()> {
    let made = Made::new()?;
    made.write("config.yaml", WALK.as_bytes())?;
    made.write("policy.onnx", &onnx::linear(63, 4, &[]))?;
    let error = message(reading(&made, ""));
    ensure!(
        error.contains("config.yaml has no dt, which rl_sar reads from dog/base.yaml: name the folder dog"),
        "{error}"
    );
    // A file of the older layout has all keys.
    made.write("base.yaml", BASE.as_bytes())?;
    agrees(&made, "", &UPSTREAM)
}

#[test]
fn torchscript_is_refused_with_its_export() -> Result<()> {
    let made = robot(BASE, &edited(WALK, &[("policy.onnx", "it's.pt")]), 63)?;
    made.write("walk/it's.pt", b"PK")?;
    let error = message(reading(&made, ""));
    for part in ["walk/config.yaml: dog/walk.model_name", "TorchScript", "torch.zeros(1, 63)", "'walk/it'\"'\"'s.onnx'"]
    {
        ensure!(error.contains(part), "{part:?} is not in: {error}");
    }
    // The exported file is read under the same name.
    made.write("walk/it's.onnx", &onnx::linear(63, 4, &[]))?;
    agrees(&made, "", &UPSTREAM)
}

#[test]
fn bad_bundles_are_refused() -> Result<()> {
    let same = ("dog/walk:", "dog/walk:");
    // Changes of base.yaml and of config.yaml.
    let cases = [
        (
            "too few numbers",
            same,
            ("[0.8, -1.5, 0.1, 0.2]", "[0.8, -1.5]"),
            "dog/walk.num_of_dofs says 4, and walk/config.yaml: dog/walk.default_dof_pos says 2 values",
        ),
        ("too few gains", same, ("[20.0, 30.0, 0.0, 0.0]", "[20.0]"), "rl_kp says 1 values"),
        ("too few scales", same, ("[0.25, 0.125, 5.0, 4.0]", "[0.25]"), "action_scale says 1 values"),
        (
            "too few limits",
            same,
            ("lower: [-0.6, -0.5, -0.7, -0.6]", "lower: [-0.6]"),
            "clip_actions_lower says 1 values",
        ),
        (
            "NaN",
            same,
            ("[0.5, 0.6, 0.7, 0.8]", "[0.5, .nan, 0.7, 0.8]"),
            "rl_kd (line 11) must be a list of finite numbers",
        ),
        ("a word", same, ("clip_obs: 1.5", "clip_obs: far"), "dog/walk.clip_obs (line 7) must be a number from 0"),
        ("a limit below 0", same, ("clip_obs: 1.5", "clip_obs: -1"), "clip_obs (line 7) must be a number from 0"),
        ("no scale", same, ("  ang_vel_scale: 0.25\n", ""), "walk/config.yaml: dog/walk.ang_vel_scale is missing"),
        (
            "no terms",
            same,
            ("  clip_obs: 1.5\n", "  clip_obs: 1.5\n  observations: []\n"),
            "key \"observations\" occurs twice",
        ),
        ("a term twice", same, ("\"dof_vel\"", "\"dof_pos\""), "\"dof_pos\" occurs twice"),
        ("a control character", same, ("\"dof_vel\"", "\"dof\\e[2J\""), "term 4 (the first is 0) is no name"),
        (
            "another length",
            same,
            ("num_observations: 21", "num_observations: 20"),
            "num_observations says 20, and walk/config.yaml: dog/walk.observations says terms of 21 values",
        ),
        (
            "limits that cross",
            same,
            ("upper: [0.6, 0.65, 0.7, 0.8]", "upper: [0.6, -0.65, 0.7, 0.8]"),
            "limits of action 1 (the first is 0)",
        ),
        (
            "one limit",
            same,
            ("  clip_actions_upper: [0.6, 0.65, 0.7, 0.8]\n", ""),
            "clip_actions_lower is there without clip_actions_upper",
        ),
        ("a motor twice", same, ("[2, 0, 3, 1]", "[2, 0, 2, 1]"), "joint_mapping: joint 2 occurs twice"),
        (
            "a motor too far",
            same,
            ("[2, 0, 3, 1]", "[2, 0, 4, 1]"),
            "joint 2 of the policy is joint 4 of the robot, and base.yaml: dog.joint_names says 4 joints",
        ),
        (
            "half a motor",
            same,
            ("[2, 0, 3, 1]", "[2, 0, 2.5, 1]"),
            "joint_mapping (line 24) must be a list of joints' numbers",
        ),
        (
            "a wheel too far",
            same,
            ("wheel_indices: [2, 3]", "wheel_indices: [4]"),
            "wheel_indices: there is no joint 4",
        ),
        (
            "a wheel twice",
            same,
            ("wheel_indices: [2, 3]", "wheel_indices: [3, 3]"),
            "wheel_indices: joint 3 occurs twice",
        ),
        ("uneven frames", same, ("[0, 1, 2]", "[0, 1, 3]"), "only numbers in equal steps"),
        ("frames without this tick", same, ("[0, 1, 2]", "[1, 2, 3]"), "only numbers in equal steps"),
        ("an unknown priority", same, ("priority: \"time\"", "priority: \"env\""), "must be \"time\" or \"term\""),
        (
            "two orders",
            same,
            ("  rl_kp", "  joint_names: [fl_leg]\n  rl_kp"),
            "dog/walk.joint_names says joint 0 (the first is 0) is \"fl_leg\", and base.yaml: dog.joint_names says joint 0 (the first is 0) is \"fr_leg\"",
        ),
        ("a joint twice", ("\"fr_foot\"", "\"fr_leg\""), same, "dog.joint_names: \"fr_leg\" occurs twice"),
        ("a joint with a control character", ("\"fr_foot\"", "\"fr\\u202e\""), same, "is not a name"),
        ("no time", ("dt: 0.005", "dt: 0"), same, "base.yaml: dog.dt (line 2) must be a number above 0"),
        ("no joints", same, ("num_of_dofs: 4", "num_of_dofs: 0"), "num_of_dofs is 0"),
        (
            "a file outside",
            same,
            ("\"policy.onnx\"", "\"../../policy.onnx\""),
            "there is no \"walk/../../policy.onnx\" in the bundle",
        ),
        ("a file of the system", same, ("\"policy.onnx\"", "\"/etc/passwd\""), "has no ending"),
        ("no ending", same, ("\"policy.onnx\"", "\"policy\""), "\"policy\" has no ending"),
        ("a gait generator", same, ("  rl_kp", "  use_pmtg_controller: true\n  rl_kp"), "PMTG is not supported"),
        ("damaged YAML", ("dt: 0.005", "dt: [0.005"), same, "not YAML"),
    ];
    for (name, of_base, of_config, expected) in cases {
        let edit = |text: &str, edit: (&str, &str)| if edit == same { text.to_owned() } else { edited(text, &[edit]) };
        let made = robot(&edit(BASE, of_base), &edit(WALK, of_config), 63)?;
        refused(name, reading(&made, ""), expected)?;
    }
    let error = message(reading(&robot(BASE, WALK, 64)?, ""));
    ensure!(error.contains("observations says 63 values, and walk/policy.onnx: actor_obs says 64 values"), "{error}");
    Ok(())
}
