//! Bundles of holosoma.

use actq::error::{Result, ensure};

use crate::common::made::{Files, agrees, message, refused};
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

/// The layout of release 0.0.3: terms in another order than that of their names, two frames each.
const LAYOUT: &str = r#"[
  {"group": "actor_obs", "name": "dof_vel", "func": "holosoma.managers.observation.terms.locomotion:dof_vel", "dim": 2,
   "history_length": 2, "scale": 0.05, "clip": [-1.0, 1.0], "params": {}},
  {"group": "actor_obs", "name": "base_ang_vel", "func": "holosoma.managers.observation.terms.locomotion:base_ang_vel", "dim": 3,
   "history_length": 2, "scale": [0.25, 0.5, 1.0], "clip": null, "params": {}}]"#;
/// Answers beside the layout.
const STATED: &str = "rate_hz = 50\ndefault = [0.1, 0.2]\n";

fn stated(from: &str, to: &str) -> Files {
    clipped(from, to, "0.2")
}

fn clipped(from: &str, to: &str, clip: &str) -> Files {
    assert!(LAYOUT.contains(from), "{from}");
    let layout = if from.is_empty() { LAYOUT.to_owned() } else { LAYOUT.replace(from, to) };
    let more = [("observation_layout", layout.as_str()), ("observation_clip", clip), ("action_scale", "0.5")];
    files(onnx::linear(2 * (2 + 3), 2, &[&METADATA[..], &more].concat()))
}

#[test]
fn the_layout_of_the_metadata_is_read() -> Result<()> {
    let raw =
        |name: &str, len: usize, tick: usize| (0..len).map(|i| (name.len() + tick + i) as f64).collect::<Vec<_>>();
    let ticks = stated("", "").run(STATED, 2, raw)?;
    // Scaled, then clipped; oldest first after zeros; the whole observation is clipped to 0.2.
    let close = |own: &[f64], expected: &[f64]| own.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6);
    ensure!(close(&ticks[0].0, &[0.0, 0.0, 0.2, 0.2, 0.0, 0.0, 0.0, 0.2, 0.2, 0.2]), "{ticks:?}");
    let wide = clipped("", "", "9e9").run(STATED, 2, raw)?;
    let dof_vel = |tick: f64| [7.0 + tick, 8.0 + tick].map(|value: f64| (value * 0.05).clamp(-1.0, 1.0));
    let base = |tick: f64| [(12.0 + tick) * 0.25, (13.0 + tick) * 0.5, 14.0 + tick];
    let expected = [&dof_vel(0.0)[..], &dof_vel(1.0), &base(0.0), &base(1.0)].concat();
    ensure!(close(&wide[1].0, &expected), "{:?}, not {expected:?}", wide[1].0);
    let weights = onnx::weights(10, 2);
    let action = 0.5 + expected.iter().enumerate().map(|(i, value)| value * f64::from(weights[2 * i])).sum::<f64>();
    ensure!((wide[1].1[0] - (0.1 + 0.5 * action)).abs() < 1e-5, "{:?}, not {action}", wide[1].1);
    Ok(())
}

#[test]
fn answers_must_agree_with_the_layout() -> Result<()> {
    for right in
        ["scales.dof_vel = 0.05", "history.length = 2", "action_scale = 0.5", "terms = [\"dof_vel\", \"base_ang_vel\"]"]
    {
        let reading = stated("", "").reading(true, &format!("{right}\n{STATED}"))?;
        ensure!(reading.questions.is_empty(), "{right}: {:?}", reading.questions);
    }
    let at = "observation_layout";
    for (wrong, expected) in [
        ("scales.dof_vel = 0.1", at),
        ("history.length = 1", at),
        ("action_scale = 0.25", "action_scale"),
        ("terms = [\"base_ang_vel\", \"dof_vel\"]", at),
    ] {
        let error = message(stated("", "").reading(true, &format!("{wrong}\n{STATED}")));
        ensure!(
            error.contains("the answer says") && error.contains(&format!("metadata: {expected}")),
            "{wrong}: {error}"
        );
    }
    for (from, to, expected) in [
        ("\"dim\": 2", "\"dim\": 3", "length of the term \"dof_vel\""),
        (
            "\"history_length\": 2, \"scale\": 0.05",
            "\"history_length\": 3, \"scale\": 0.05",
            "length of the observation",
        ),
        ("[-1.0, 1.0]", "[1.0, -1.0]", "clip must be two numbers"),
        ("0.05", "NaN", "scale must be one finite number, or 2"),
    ] {
        refused(to, stated(from, to).reading(true, STATED), expected)?;
    }
    assert_eq!(stated("locomotion:dof_vel", "mine:speed").asked(true, STATED)?, ["raw.dof_vel"]);
    Ok(())
}
