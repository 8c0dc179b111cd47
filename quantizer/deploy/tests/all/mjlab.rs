//! mjlab's bundles. The published one runs where `ACTQ_SHARED` names the folder of the bundles.

use actq::error::{Context as _, Result, ensure};
use actq_deploy::description::{Op, Operand};
use actq_deploy::{Answers, Bundle, read};
use std::fs;

use crate::common::made::{Files, agrees, asked, message, refused, shared, shared_file};
use crate::common::onnx;

const NAME: &str = "bitbots_walk_mjlab";

#[test]
fn two_orders_of_joints_are_refused() -> Result<()> {
    let Some(folder) = shared(NAME) else { return Ok(()) };
    let error = message(read(&Bundle::open(&folder.join("bundle"))?, true, Answers::default()));
    for part in [
        "contradicts itself",
        "models/walk_mjlab.onnx metadata: joint_names says joint 0 (from 0) is \"r_shoulder_pitch_joint\"",
        "configs/mjlab_walk_model.yaml: mjlab_walk_node.ros__parameters.joints.ordered_relevant_joint_names says joint 0 (from 0) is \"r_hip_pitch_joint\"",
        "joints.order",
    ] {
        ensure!(error.contains(part), "{part} is not in: {error}");
    }
    Ok(())
}

#[test]
fn mjlab_agrees_in_the_order_that_is_answered() -> Result<()> {
    agrees(NAME, "expect.npz", "joints.order = \"file\"\n")?;
    agrees(NAME, "expect_metadata_order.npz", "joints.order = \"metadata\"\n")
}

#[test]
fn rules_are_questions_until_accepted() -> Result<()> {
    let Some(folder) = shared(NAME) else { return Ok(()) };
    let bundle = Bundle::open(&folder.join("bundle"))?;
    let answers = "joints.order = \"file\"\n";
    let reading = read(&bundle, false, Answers::parse(answers)?)?;
    let asked = asked(&reading);
    for key in ["terms.plain", "joint_pos.relative", "last_action", "target.base", "ros.gravity"] {
        ensure!(asked.contains(&key), "{key} is not among {asked:?}");
    }
    let unread = read(&bundle, true, Answers::parse(answers)?)?.unread;
    ensure!(unread.is_empty(), "{unread:?}");
    Ok(())
}

/// An export without a YAML file: the mecanum base's network with the exporter's metadata.
#[test]
fn metadata_alone_is_read() -> Result<()> {
    let Some(file) = shared_file("onnx/mjlab_mecanum/model.onnx") else { return Ok(()) };
    let metadata = [
        ("joint_names", "a,b,c,d"),
        ("joint_stiffness", "1.000,2.000,3.000,4.000"),
        ("joint_damping", "0.100,0.200,0.300,0.400"),
        ("default_joint_pos", "0.500,0.000,0.000,-0.500"),
        ("action_scale", "0.1,0.2,0.3,0.4"),
        ("observation_names", "base_ang_vel,joint_vel,command"),
        ("command_names", "twist"),
        ("run_path", "x"),
    ];
    let files = Files::default().with_file("policy.onnx", onnx::with_metadata(fs::read(file)?, &metadata));
    assert_eq!(files.asked(true, "")?, ["rate_hz"]);
    let reading = files.reading(true, "rate_hz = 25.0\n")?;
    ensure!(reading.questions.is_empty() && reading.unread.is_empty(), "{reading:?}");
    ensure!(reading.description.rate_hz == 25.0, "{}", reading.description.rate_hz);
    let plan = files.plan(&reading.description)?;
    let inputs: Vec<(&str, usize)> = plan.inputs().iter().map(|(name, len)| (name.as_str(), *len)).collect();
    ensure!(inputs == [("joint_vel", 4), ("base_ang_vel", 3), ("command", 3)], "{inputs:?}");
    Ok(())
}

/// Metadata of a robot with 2 joints, with a key replaced.
fn metadata(key: &str, value: &str) -> Vec<(String, String)> {
    let all = [
        ("joint_names", "a,b"),
        ("joint_stiffness", "1,2"),
        ("joint_damping", "3,4"),
        ("default_joint_pos", "0.5,-0.5"),
        ("action_scale", "0.25"),
        ("observation_names", "base_lin_vel,base_ang_vel,projected_gravity,joint_pos,joint_vel,actions,command"),
        ("command_names", "twist"),
    ];
    let set = |(name, old): (&str, &str)| (name.to_owned(), if name == key { value } else { old }.to_owned());
    all.into_iter().map(set).collect()
}

/// Values of the terms above.
const FRAME: usize = 3 + 3 + 3 + 2 + 2 + 2 + 3;

fn files(observation: usize, actions: usize, metadata: &[(String, String)], yaml: &str) -> Files {
    let metadata: Vec<(&str, &str)> = metadata.iter().map(|(key, value)| (key.as_str(), value.as_str())).collect();
    let (inputs, outputs) = ([("obs", observation), ("time_step", 1)], [("actions", actions), ("joint_pos", 2)]);
    let files = Files::default().with_file("policy.onnx", onnx::graph(&[], &[], &inputs, &outputs, &metadata));
    if yaml.is_empty() { files } else { files.with_file("node.yaml", yaml) }
}

#[test]
fn histories_are_asked_if_the_length_allows_them() -> Result<()> {
    let three = files(3 * FRAME, 2, &metadata("", ""), "");
    assert_eq!(three.asked(true, "rate_hz = 50")?, ["history.length"]);
    let description = three.reading(true, "rate_hz = 50\nhistory.length = 3")?.description;
    let text = format!("{:?}", description.values);
    ensure!(text.matches("History(History { length: 3").count() == 7, "{text}");
    refused("two frames", three.reading(true, "rate_hz = 50\nhistory.length = 2"), &format!("takes {}", 3 * FRAME))?;

    // Some terms only.
    let some = files(FRAME + 4, 2, &metadata("", ""), "");
    let error = message(some.reading(true, "rate_hz = 50"));
    ensure!(error.contains("contradicts") && error.contains("joint_pos 2"), "{error}");
    let asked = some.reading(true, "rate_hz = 50\nhistory.length = [1, 1, 1, 2, 2, 1, 1]")?.questions;
    ensure!(asked.is_empty(), "{asked:?}");
    Ok(())
}

/// Metadata of release 1.6.0 with a key replaced.
fn stated(key: &str, value: &str) -> Vec<(String, String)> {
    let new = [
        ("observation_terms_scale", "1.000,0.250,1.000,1.000,0.050,1.000,2.000;2.000;0.250"),
        ("observation_terms_clip", "-inf;inf,-inf;inf,-inf;inf,-inf;inf,-10.000;10.000,-inf;inf,-1.000;inf"),
        ("observation_terms_history_length", "0.000,0.000,0.000,3.000,1.000,2.000,0.000"),
        ("observation_terms_flatten_history_dim", "1.000,1.000,1.000,1.000,1.000,1.000,1.000"),
    ];
    let set = |(name, own): (&str, &str)| (name.to_owned(), if name == key { value } else { own }.to_owned());
    metadata(key, value).into_iter().chain(new.into_iter().map(set)).collect()
}

/// Values of the observation with these histories.
const STATED: usize = FRAME + 2 * 2 + 2;

#[test]
fn scales_clips_and_histories_are_read() -> Result<()> {
    let bundle = files(STATED, 2, &stated("", ""), "");
    let reading = bundle.reading(true, "rate_hz = 50")?;
    ensure!(reading.questions.is_empty() && reading.unread.is_empty(), "{reading:?}");
    let description = &reading.description;
    let constants = &description.constants;
    ensure!(
        constants["scale_base_ang_vel"] == [0.25; 3] && constants["scale_command"] == [2.0, 2.0, 0.25],
        "{constants:?}"
    );
    let ops = |name: &str| description.values.iter().find(|value| value.name == name).map(|value| &value.ops[..]);
    let scale = |name: &str| Op::Scale(Operand::Name(format!("scale_{name}")));
    let clip = |low: f64, high: f64| Op::Clip([Operand::Number(low), Operand::Number(high)]);
    // Clipped, then scaled.
    ensure!(ops("joint_vel_term") == Some(&[clip(-10.0, 10.0), scale("joint_vel")]), "{:?}", description.values);
    let above = clip(-1.0, f64::from(f32::MAX));
    ensure!(ops("command_term") == Some(&[above, scale("command")]), "{:?}", description.values);
    ensure!(ops("base_ang_vel_term") == Some(&[scale("base_ang_vel")]), "{:?}", description.values);
    let text = format!("{:?}", description.values);
    for (length, count) in [(3, 1), (2, 1)] {
        ensure!(text.matches(&format!("History(History {{ length: {length}")).count() == count, "{text}");
    }
    ensure!(description.rounding["scale_command"] == 0.0005, "{:?}", description.rounding);
    Ok(())
}

#[test]
fn wrong_statements_of_terms_are_refused() -> Result<()> {
    let cases = [
        ("observation_terms_scale", "1,1", "observation_terms_scale has 2 entries, and observation_names 7"),
        ("observation_terms_scale", "1,1,1,1,1,1,inf", "inf is not finite"),
        ("observation_terms_scale", "1,1,1,1,1,1,1;2", "term \"command\" has 3 values, and 2 factors"),
        ("observation_terms_scale", "1,1,1,1,1,1,x", "\"x\" is not a number"),
        ("observation_terms_clip", "1;0,1;2,1;2,1;2,1;2,1;2,1;2", "give two numbers for each term"),
        ("observation_terms_history_length", "0,0,0,0.5,0,0,0", "0.5 is not a number of frames"),
        ("observation_terms_history_length", "0,0,0,0,0,0,0", "length of the observation"),
        ("observation_terms_flatten_history_dim", "1,1,1,0,1,1,1", "an axis of their own"),
    ];
    for (key, value, expected) in cases {
        refused(value, files(STATED, 2, &stated(key, value), "").reading(true, "rate_hz = 50"), expected)?;
    }
    Ok(())
}

#[test]
fn unknown_terms_are_asked() -> Result<()> {
    let terms = metadata("observation_names", "joint_pos,height_scan,command");
    let bundle = files(2 + 17 + 3, 2, &terms, "");
    let asked = bundle.reading(true, "rate_hz = 50")?.questions;
    ensure!(asked.len() == 1 && asked[0].key == "raw.height_scan", "{asked:?}");
    ensure!(asked[0].meaning.contains("the graph has 17 values for 1 such terms"), "{}", asked[0].meaning);
    let description = bundle.reading(true, "rate_hz = 50\nraw.height_scan = 17")?.description;
    let input = description.inputs.iter().find(|input| input.name == "height_scan");
    ensure!(input.is_some_and(|input| input.len == Some(17)), "{:?}", description.inputs);
    refused("a value less", bundle.reading(true, "rate_hz = 50\nraw.height_scan = 16"), "contradicts")?;

    // A command that is not a twist.
    let path = files(FRAME - 3 + 18, 2, &metadata("command_names", "path"), "");
    assert_eq!(path.asked(true, "rate_hz = 50")?, ["raw.command"]);
    // Joints that do not move.
    let fixed = files(FRAME - 1, 1, &metadata("", ""), "");
    assert_eq!(fixed.asked(true, "rate_hz = 50")?, ["joints.moved"]);
    refused("another joint", fixed.reading(true, "rate_hz = 50\njoints.moved = [\"z\"]"), "joints.moved")
}

const YAML: &str = "node:\n  ros__parameters:\n    model: policy.onnx\n    joints:\n      ordered_relevant_joint_names: [a, b]\n      \
    walkready_state: [0.5, -0.5001]\n      kp: [1, 2]\n      kd: [3, 4]\n      action_scales: [0.25, 0.25]\n    phase:\n      control_dt: 0.01\n";

#[test]
fn yaml_of_the_same_order_needs_no_answer() -> Result<()> {
    let reading = files(FRAME, 2, &metadata("", ""), YAML).reading(true, "")?;
    ensure!(reading.questions.is_empty(), "{:?}", reading.questions);
    ensure!(reading.description.rate_hz == 100.0, "{}", reading.description.rate_hz);
    ensure!(reading.description.constants["default"] == [0.5, -0.5001], "{:?}", reading.description.constants);
    // Signs and joints that others control.
    let yaml = YAML.replace("      kd:", "      joint_signs: [1, -1]\n      uncontrolled_joint_names: [a]\n      kd:");
    let reading = files(FRAME, 2, &metadata("", ""), &yaml).reading(true, "")?;
    let target = reading.description.targets.first().context("a target")?;
    ensure!(target.joints.as_deref() == Some("sent"), "{target:?}");
    ensure!(reading.description.joints["sent"] == ["b"], "{:?}", reading.description.joints);
    ensure!(reading.description.constants["signs"] == [1.0, -1.0], "{:?}", reading.description.constants);
    Ok(())
}

#[test]
fn bad_bundles_are_refused() -> Result<()> {
    let set = metadata;
    let plain = || set("", "");
    let yaml = |from: &str, to: &str| {
        assert!(YAML.contains(from), "{from}");
        YAML.replace(from, to)
    };
    let none = String::new;
    let cases = [
        ("another order", plain(), yaml("[a, b]", "[b, a]"), "joint 0 (from 0) is \"b\""),
        ("another joint", plain(), yaml("[a, b]", "[a, z]"), "names of the joints"),
        ("a joint twice", plain(), yaml("[a, b]", "[a, a]"), "occurs twice"),
        ("too few numbers", plain(), yaml("kp: [1, 2]", "kp: [1]"), "kp has 1 values"),
        ("another pose", plain(), yaml("-0.5001", "0.5"), "default_pose"),
        ("other gains", plain(), yaml("kp: [1, 2]", "kp: [1, 20]"), "20 for joint \"b\""),
        ("another scale", plain(), yaml("[0.25, 0.25]", "[0.25, 0.5]"), "action_scale"),
        ("NaN", plain(), yaml("[3, 4]", "[3, .nan]"), "kd"),
        ("another model", plain(), yaml("policy.onnx", "other.onnx"), "other.onnx"),
        ("no model", plain(), yaml("model: policy.onnx", "other: 1"), "model is missing"),
        ("no time step", plain(), yaml("control_dt: 0.01", "control_dt: 0"), "control_dt"),
        ("a joint twice in the metadata", set("joint_names", "a,a"), none(), "\"a\" occurs twice"),
        ("an empty name", set("joint_names", "a,"), none(), "name 1 is empty"),
        ("a word as a number", set("default_joint_pos", "0.5,x"), none(), "\"x\" is not a finite number"),
        ("NaN in the metadata", set("joint_stiffness", "nan,1"), none(), "joint_stiffness"),
        ("too many numbers", set("default_joint_pos", "1,2,3"), none(), "number of joints"),
        ("too few joints", set("joint_names", "a"), none(), "number of joints"),
        (
            "another length",
            set("observation_names", "joint_pos,joint_vel,command"),
            none(),
            "length of the observation",
        ),
        ("two terms of a name", set("observation_names", "joint_pos,joint_pos"), none(), "occurs twice"),
    ];
    for (name, metadata, yaml, expected) in cases {
        let answers = if yaml.is_empty() { "rate_hz = 50" } else { "" };
        refused(name, files(FRAME, 2, &metadata, &yaml).reading(true, answers), expected)?;
    }
    Ok(())
}
