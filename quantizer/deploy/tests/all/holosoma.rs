//! Bundles of holosoma.

use actq::error::{Result, ensure};

use crate::common::made::{Files, agrees, refused};
use crate::common::onnx;

/// Answers for the Booster T1.
const T1: &str = include_str!("holosoma.toml");

#[test]
fn holosoma_agrees_with_its_deploy_code() -> Result<()> {
    agrees("holosoma_t1_fastsac", "expect.npz", T1)
}

/// Answers for a robot with two joints.
const TWO: &str = "\
rate_hz = 50
gait_period = 1.0
action_scale = 0.25
gravity = \"wxyz\"
scales.base_ang_vel = 0.25
scales.dof_vel = 0.05
default = [0.1, 0.2]
";
const METADATA: [(&str, &str); 3] = [("dof_names", "[\"a\", \"b\"]"), ("kp", "[1.0, 2.0]"), ("kd", "[0.1, 0.2]")];
/// Length of its observation.
const LEN: usize = 3 * 2 + 3 + 3 + 3 + 4;

fn files(network: Vec<u8>) -> Files {
    Files::default().with_file("policy.onnx", network)
}

#[test]
fn another_robot_is_read() -> Result<()> {
    let two = files(onnx::linear(LEN, 2, &METADATA));
    let found = two.reading(true, TWO)?;
    ensure!(found.questions.is_empty(), "{:#?}", found.questions);
    let plan = two.plan(&found.description)?;
    assert!(plan.inputs().iter().any(|(name, len)| name == "base_quat" && *len == 4));

    // An action of fewer joints is that of the last ones.
    let three = [("dof_names", "[a, b, c]"), ("kp", "[1, 2, 3]"), ("kd", "[1, 2, 3]")];
    let answers = TWO.replace("[0.1, 0.2]", "[0.1, 0.2, 0.3]");
    let three = files(onnx::linear(LEN + 2, 2, &three));
    let found = three.reading(true, &answers)?;
    ensure!(found.questions.is_empty(), "{:#?}", found.questions);
    three.plan(&found.description)?;
    Ok(())
}

#[test]
fn every_rule_is_a_question() -> Result<()> {
    let is_asked = |accepted, mut expected: Vec<&str>| -> Result<()> {
        let mut found = files(onnx::linear(LEN, 2, &METADATA)).asked(accepted, "")?;
        found.sort();
        expected.sort_unstable();
        assert_eq!(found, expected);
        Ok(())
    };
    let open =
        ["action_scale", "default", "gait_period", "gravity", "rate_hz", "scales.base_ang_vel", "scales.dof_vel"];
    is_asked(true, open.to_vec())?;
    let ruled = [
        "action.clip",
        "clock.standing_at",
        "clock.standing_below",
        "clock.start",
        "clock.when",
        "history.length",
        "last_action",
        "order",
        "scales.other",
        "terms",
    ];
    is_asked(false, [&open[..], &ruled].concat())
}

#[test]
fn bad_files_are_refused() -> Result<()> {
    let with = |key: &str, value: &str| {
        let entries = METADATA.map(|(name, old)| (name, if name == key { value } else { old }));
        onnx::linear(LEN, 2, &entries)
    };
    let cases = [
        ("a gain less", with("kp", "[1.0]"), TWO.to_owned(), "contradicts itself"),
        ("NaN", with("kd", "[0.1, NaN]"), TWO.to_owned(), "metadata: kd (line 1) must be a list of finite numbers"),
        ("no list", with("dof_names", "robot"), TWO.to_owned(), "metadata: dof_names (line 1) must be a list of texts"),
        ("no JSON", with("kp", "[1.0, 2.0"), TWO.to_owned(), "metadata: kp (line 1) must be"),
        ("a name twice", with("dof_names", "[\"a\", \"a\"]"), TWO.to_owned(), "a name occurs twice"),
        ("another pose", with("", ""), TWO.replace("[0.1, 0.2]", "[0.1]"), "default has 1 values"),
        (
            "other terms",
            with("", ""),
            format!("terms = [\"dof_pos\"]\n{TWO}"),
            "length of the observation: the bundle contradicts itself",
        ),
        ("a longer action", onnx::linear(LEN, 3, &METADATA), TWO.to_owned(), "length of the action"),
        ("a period of 0", with("", ""), TWO.replace("gait_period = 1.0", "gait_period = 0.0"), "gait_period = 0"),
        ("a text", with("", ""), TWO.replace("= 0.25\ngravity", "= \"much\"\ngravity"), "answer action_scale"),
    ];
    for (name, file, answers, expected) in cases {
        refused(name, files(file).reading(true, &answers), expected)?;
    }
    Ok(())
}
