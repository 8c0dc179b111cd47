//! LeRobot's policies of states against LeRobot's arithmetic, which this test writes out.

use actq::error::{Result, ensure};
use actq_deploy::description::TargetKind;

use crate::common::lerobot::{files, older, raw, run, statistics};
use crate::common::made::Files;
use crate::common::onnx;

/// LeRobot's arithmetic, in both versions: `buffers` is that of the policies' own buffers.
fn normalized(x: f64, mode: &str, at: [f64; 2], buffers: bool) -> f64 {
    let [low, high] = at;
    match (mode, buffers) {
        ("IDENTITY", _) => x,
        ("MEAN_STD", _) => (x - low) / (high + 1e-8),
        (_, false) => 2.0 * (x - low) / if high == low { 1e-8 } else { high - low } - 1.0,
        (_, true) => (x - low) / (high - low + 1e-8) * 2.0 - 1.0,
    }
}

fn restored(x: f64, mode: &str, at: [f64; 2], buffers: bool) -> f64 {
    let [low, high] = at;
    match (mode, buffers) {
        ("IDENTITY", _) => x,
        ("MEAN_STD", _) => x * high + low,
        (_, false) => (x + 1.0) / 2.0 * if high == low { 1e-8 } else { high - low } + low,
        (_, true) => (x + 1.0) / 2.0 * (high - low) + low,
    }
}

fn statistics_of(feature: &str, mode: &str) -> Vec<[f64; 2]> {
    let [low, high] = match mode {
        "MEAN_STD" => ["mean", "std"],
        "QUANTILES" => ["q01", "q99"],
        "QUANTILE10" => ["q10", "q90"],
        _ => ["min", "max"],
    };
    statistics(feature, low).into_iter().zip(statistics(feature, high)).map(|(low, high)| [low, high]).collect()
}

/// The network of [`onnx::linear`].
fn linear(observation: &[f64], outputs: usize) -> Vec<f64> {
    let weights = onnx::weights(observation.len(), outputs);
    let value = |j: usize| {
        let weighted = observation.iter().enumerate().map(|(i, x)| x * f64::from(weights[i * outputs + j]));
        0.5 + weighted.sum::<f64>()
    };
    (0..outputs).map(value).collect()
}

#[track_caller]
fn near(values: &[f64], expected: &[f64], what: &str) {
    let same =
        values.iter().zip(expected).all(|(value, expected)| (value - expected).abs() < 1e-5 * (1.0 + expected.abs()));
    assert!(same && values.len() == expected.len(), "{what}: {values:?}, not {expected:?}");
}

#[test]
fn policies_agree_with_lerobot() -> Result<()> {
    for (buffers, files) in [(false, files()), (true, older())] {
        let modes = ["MIN_MAX", "MEAN_STD", "IDENTITY", "QUANTILES", "QUANTILE10"];
        for state in &modes[..if buffers { 3 } else { 5 }] {
            for action in &modes[..if buffers { 3 } else { 4 }] {
                let files = files.with_in("json", r#""STATE": "MIN_MAX""#, &format!(r#""STATE": "{state}""#));
                let files = files.with_in("json", r#""ACTION": "MEAN_STD""#, &format!(r#""ACTION": "{action}""#));
                for (tick, (observation, target)) in run(&files, "")?.into_iter().enumerate() {
                    let what = format!("{state}, {action}, buffers {buffers}, tick {tick}");
                    let expected = raw(tick, 3).into_iter().zip(statistics_of("observation.state", state));
                    let expected: Vec<f64> = expected.map(|(x, at)| normalized(x, state, at, buffers)).collect();
                    near(&observation, &expected, &what);
                    let given = linear(&expected, 2).into_iter().zip(statistics_of("action", action));
                    let expected: Vec<f64> = given.map(|(x, at)| restored(x, action, at, buffers)).collect();
                    near(&target, &expected, &what);
                }
            }
        }
    }
    Ok(())
}

/// A policy with two observations of each of two features, whose network has an input for each.
fn with_history() -> Files {
    let (input_features, features) = (r#""input_features": {"#, r#""features": {"#);
    let env = r#""environment": {"type": "ENV", "shape": [2]}, "#;
    let nodes = [
        ("Gemm", &["observation_state", "w", "b"][..], "a"),
        ("Gemm", &["environment", "v", "c"], "e"),
        ("Add", &["a", "e"], "action"),
    ];
    let tensors = [
        ("w", &[6, 2][..], onnx::weights(6, 2)),
        ("b", &[2], vec![0.5; 2]),
        ("v", &[4, 2], onnx::weights(4, 2)),
        ("c", &[2], vec![0.5; 2]),
    ];
    let inputs = [("observation_state", 6), ("environment", 4)];
    files()
        .with_in("config.json", input_features, &format!("{input_features}{env}"))
        .with_in("policy_preprocessor.json", features, &format!("{features}{env}"))
        .with_in("json", r#""n_obs_steps": 1"#, r#""n_obs_steps": 2"#)
        .with_file("policy.onnx", onnx::graph(&nodes, &tensors, &inputs, &[("action", 2)], &[]))
}

#[test]
fn observations_are_kept_as_populate_queues_does() -> Result<()> {
    let mut queues: [Vec<Vec<f64>>; 2] = Default::default();
    for (tick, (observation, target)) in run(&with_history(), "")?.into_iter().enumerate() {
        let state = raw(tick, 3).into_iter().zip(statistics_of("observation.state", "MIN_MAX"));
        let state: Vec<f64> = state.map(|(x, at)| normalized(x, "MIN_MAX", at, false)).collect();
        // The file has no mode for ENV, so these values are not normalized.
        for (queue, frame) in queues.iter_mut().zip([state, raw(tick, 2)]) {
            queue.push(frame.clone());
            while queue.len() < 2 {
                queue.push(frame.clone());
            }
            *queue = queue[queue.len() - 2..].to_vec();
        }
        let [state, env] = queues.each_ref().map(|queue| queue.concat());
        near(&observation, &[state.clone(), env.clone()].concat(), &format!("tick {tick}"));
        let given: Vec<f64> = linear(&state, 2).iter().zip(linear(&env, 2)).map(|(a, e)| a + e).collect();
        let expected = given.into_iter().zip(statistics_of("action", "MEAN_STD"));
        let expected: Vec<f64> = expected.map(|(x, at)| restored(x, "MEAN_STD", at, false)).collect();
        near(&target, &expected, &format!("tick {tick}"));
    }
    Ok(())
}

#[test]
fn rules_are_questions_until_accepted() -> Result<()> {
    let asked = |files: &Files, accepted, answers| -> Result<Vec<String>> {
        let mut keys = files.asked(accepted, answers)?;
        keys.sort();
        Ok(keys)
    };
    assert_eq!(asked(&files(), false, "")?, ["range.eps", "types"]);
    assert_eq!(asked(&older(), false, "")?, ["buffers.eps", "buffers.range.eps", "types"]);
    let history = ["history.fill", "history.first", "range.eps", "types"];
    assert_eq!(asked(&with_history(), false, "")?, history);
    let unnamed = files().without("meta/info.json");
    assert_eq!(asked(&unnamed, false, "")?, ["range.eps", "rate_hz", "target.kind", "types"]);
    assert_eq!(asked(&unnamed, true, "")?, ["rate_hz"]);
    let several = files().with_file("other.onnx", onnx::linear(3, 2, &[]));
    assert_eq!(asked(&several, true, "")?, ["network"]);
    let chunk = files().with_in("json", r#""n_action_steps": 1"#, r#""n_action_steps": 100"#);
    assert_eq!(asked(&chunk, true, "")?, ["replan"]);
    let random = files().with_in("json", r#""type": "act""#, r#""type": "gaussian_actor""#);
    assert_eq!(asked(&random, true, "")?, ["graph.complete"]);
    let answered = chunk.with_in("json", r#""type": "act""#, r#""type": "sac""#);
    assert!(asked(&answered, true, "replan = true\ngraph.complete = true\n")?.is_empty());
    assert!(asked(&random, true, "types = [\"gaussian_actor\"]\n")?.is_empty());
    Ok(())
}

#[test]
fn each_convention_changes_the_result() -> Result<()> {
    let (processors, older, history) = (files(), older(), with_history());
    let state = r#""STATE": "MIN_MAX""#;
    let action = |files: &Files| files.with_in("json", r#""ACTION": "MEAN_STD""#, r#""ACTION": "MIN_MAX""#);
    let cases = [
        ("range.eps", &processors, processors.clone(), "range.eps = \"all\""),
        ("buffers.range.eps", &older, older.clone(), "buffers.range.eps = \"zero\""),
        ("buffers.eps", &older, older.clone(), "buffers.eps = 1e-7"),
        ("history.first", &history, history.clone(), "history.first = \"newest\""),
        ("history.fill", &history, history.clone(), "history.fill = \"zero\""),
        ("eps", &processors, processors.with_in("policy_preprocessor.json", "1e-08", "1e-07"), ""),
        ("mode of the state", &processors, processors.with_in("json", state, r#""STATE": "QUANTILES""#), ""),
        ("mode of the action", &processors, action(&processors), ""),
        ("mode of the action's buffers", &older, action(&older), ""),
    ];
    for (name, from, to, answers) in cases {
        let [first, second] = [run(from, "")?, run(&to, answers)?];
        // With range.eps, only the divisors of ranges above 0 differ, by 1e-8.
        let same = first.iter().zip(&second).all(|(first, second)| first == second);
        ensure!(!same, "{name}: no difference");
    }
    let keys = r#""eps": 1e-08, "normalize_observation_keys": []"#;
    let excluded = processors.with_in("policy_preprocessor.json", r#""eps": 1e-08"#, keys);
    near(&run(&excluded, "")?[3].0, &raw(3, 3), "no observation is normalized");
    Ok(())
}

#[test]
fn names_give_the_kinds_of_targets() -> Result<()> {
    let kinds = |files: &Files, answers: &str| -> Result<Vec<(TargetKind, String, Option<String>)>> {
        let targets = files.reading(true, answers)?.description.targets;
        Ok(targets.into_iter().map(|target| (target.kind, target.value, target.joints)).collect())
    };
    let target = |kind, value: &str, joints: Option<&str>| (kind, value.to_owned(), joints.map(str::to_owned));
    let all = target(TargetKind::Position, "target", Some("action"));
    assert_eq!(kinds(&files(), "")?, [all]);
    let mixed = [
        target(TargetKind::Position, "target_pos", Some("action_pos")),
        target(TargetKind::Velocity, "target_vel", Some("action_vel")),
    ];
    let mixed_files = files().with_in("json", r#""gripper.pos""#, r#""gripper.vel""#);
    assert_eq!(kinds(&mixed_files, "")?, mixed);
    let two: Vec<_> = run(&mixed_files, "")?.into_iter().map(|(_, targets)| targets).collect();
    let one: Vec<_> = run(&files(), "")?.into_iter().map(|(_, targets)| targets).collect();
    assert_eq!(two, one, "positions before velocities, as in the action");
    let unnamed = files().without("meta/info.json");
    let answers = "rate_hz = 30\ntarget.kind = \"torque\"\n";
    assert_eq!(kinds(&unnamed, answers)?, [target(TargetKind::Torque, "target", None)]);
    let names = "\"pan.pos\",\n                \"gripper.pos\"";
    let axis = files().with_in("meta/info.json", names, r#""keypoints""#);
    assert_eq!(kinds(&axis, "")?, [target(TargetKind::Position, "target", None)]);
    Ok(())
}
