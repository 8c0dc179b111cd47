//! Files of LeRobot's policies that contradict each other, are damaged, or are not supported.

use actq::error::{Result, ensure};
use actq_testkit::{Dtype, safetensors};

use crate::common::lerobot::{CONFIG, STATE_FILES, files, older, statistics_with};
use crate::common::made::{Files, asked, message, refused};
use crate::common::onnx;

/// A graph whose first or last operations are those of a normalizer.
fn normalizing(nodes: &[(&str, &[&str], &str)]) -> Vec<u8> {
    let tensors = [
        ("w", &[3, 2][..], onnx::weights(3, 2)),
        ("b", &[2], vec![0.5; 2]),
        ("mean", &[3], vec![0.5, -1.0, 0.25]),
        ("std", &[3], vec![0.5, 2.0, 1.0]),
        ("scale", &[2], vec![3.0, 4.0]),
        ("offset", &[2], vec![10.0, -20.0]),
    ];
    onnx::graph(nodes, &tensors, &[("observation.state", 3)], &[("action", 2)], &[])
}

#[test]
fn a_normalizer_in_the_graph_is_refused() -> Result<()> {
    let files = files()
        .with_file(STATE_FILES[0], statistics_with("observation.state.std", &[0.5, 2.0, 1.0]))
        .with_file(STATE_FILES[1], statistics_with("action.std", &[3.0, 4.0]))
        .with_in("json", r#""STATE": "MIN_MAX""#, r#""STATE": "MEAN_STD""#);
    let first: [(&str, &[&str], &str); 3] = [
        ("Sub", &["observation.state", "mean"], "x"),
        ("Div", &["x", "std"], "y"),
        ("Gemm", &["y", "w", "b"], "action"),
    ];
    let last: [(&str, &[&str], &str); 3] = [
        ("Gemm", &["observation.state", "w", "b"], "x"),
        ("Mul", &["x", "scale"], "y"),
        ("Add", &["y", "offset"], "action"),
    ];
    let plain: [(&str, &[&str], &str); 2] =
        [("Gemm", &["observation.state", "w", "b"], "x"), ("Tanh", &["x"], "action")];
    let with =
        |nodes: &[(&str, &[&str], &str)]| message(files.with_file("policy.onnx", normalizing(nodes)).reading(true, ""));
    for (graph, part) in [
        (with(&first), "policy.onnx says that the graph normalizes with the same numbers"),
        (with(&last), "policy.onnx says that the graph reverses it with the same numbers"),
    ] {
        ensure!(graph.contains(part) && graph.contains("that it is outside of the network"), "{graph}");
    }
    ensure!(with(&plain).starts_with("accepted"), "{}", with(&plain));
    Ok(())
}

/// The state file of the observation.
const STATE: &str = STATE_FILES[0];
/// A training at another rate.
const TRAIN: &str = r#"{"env": {"type": "gym", "fps": 20}}"#;

/// Asserts that the files are refused with a message that contains `expected`, and no control character.
fn refused_safely(name: &str, files: &Files, expected: &str) -> Result<()> {
    let error = message(files.reading(true, ""));
    ensure!(error.contains(expected) && !error.contains('\u{1b}'), "{name}: {error}");
    Ok(())
}

#[test]
fn edited_files_are_refused() -> Result<()> {
    let (before, after, config) = ("policy_preprocessor.json", "policy_postprocessor.json", "config.json");
    let inputs = r#""input_features": {"#;
    let image = r#""input_features": {"observation.images.top": {"type": "VISUAL", "shape": [3, 480, 640]},"#;
    let (outputs, two) = (r#""output_features": {"#, r#""output_features": {"x": {"type": "ACTION", "shape": [1]},"#);
    let sound = r#""input_features": {"observation.audio": {"type": "AUDIO", "shape": [3]},"#;
    let cases = [
        ("json", inputs, image, "config.json: input_features.observation.images.top is an image [3, 480, 640]"),
        ("json", inputs, sound, "the type \"AUDIO\" is not supported; STATE and ENV are"),
        ("json", inputs, r#""input_features": null, "x": {"#, "it has no features"),
        (config, " 3\n", " 3, 2\n", "shape = [3, 2]: give one length"),
        (config, " 3\n", " 0\n", "must be a list of lengths above 0"),
        ("json", outputs, two, "it has 2 features"),
        (config, r#""action": {"#, r#""torque": {"#, "the only output must be \"action\""),
        (config, r#""type": "act""#, r#""kind": "act""#, "config.json: type is missing"),
        ("json", r#"_coeff": null"#, r#"_coeff": 0.01"#, "average the actions of several chunks"),
        ("json", r#""n_obs_steps": 1"#, r#""n_obs_steps": 2"#, "6 values in 2 observations"),
        ("json", r#""n_obs_steps": 1"#, r#""n_obs_steps": 0"#, "must be a number of observations"),
        (before, "\"policy_preprocessor_step_3", "\"../x_step_3", "without .."),
        (
            before,
            "state_file",
            "state_files",
            "policy_preprocessor.json step 3: it has no min of \"observation.state\"",
        ),
        (before, "1e-08", "0.0", "value 2 (from 0) gives a division by 0"),
        (before, "1e-08", "NaN", "config.eps (line 24) must be a finite number"),
        (before, "1e-08", "2.0", "give a number from 0 to below 1"),
        (
            config,
            r#""STATE": "MIN_MAX""#,
            r#""STATE": "MEAN_STD""#,
            "config.json: normalization_mapping.STATE says MEAN_STD, and policy_preprocessor.json step 3: config.norm_map.STATE says MIN_MAX",
        ),
        ("json", r#""STATE": "MIN_MAX""#, r#""STATE": "LOG""#, "\"LOG\": give IDENTITY"),
        (before, " 3\n", " 4\n", "shape of \"observation.state\": the bundle contradicts itself"),
        (before, "observation.state", "observation.other", "that there is no such feature"),
        (before, "to_batch_processor", "tokenizer_processor", "\"tokenizer_processor\" is not supported"),
        (before, r#""float_dtype": null"#, r#""float_dtype": "float16""#, "only float32 is supported"),
        (after, "unnormalizer_processor\"", "device_processor\"", "none of its steps is unnormalizer_processor"),
        (before, r#""eps": 1e-08"#, r#""eps": 1e-08, "stats": {"a": 1}"#, "it takes the place of the state_file"),
        ("json", r#""fps": 30"#, r#""fps": 0"#, "give a number above 0"),
        ("meta/info.json", "\"lift.pos\",\n", "", "number of values of \"observation.state\""),
        ("meta/info.json", "lift.pos", "pan.pos", "\"pan.pos\" occurs twice"),
        ("meta/info.json", " 3\n", " 4\n", "shape of \"observation.state\""),
        (config, r#""use_amp": false"#, r#""device": "cpu""#, "occurs twice"),
        (config, r#""type": "AC"#, r#""type": "\u001b[2J"#, "the only output must be"),
    ];
    for (file, from, to, expected) in cases {
        refused_safely(&format!("{file}: {from} -> {to}"), &files().with_in(file, from, to), expected)?;
    }
    Ok(())
}

#[test]
fn other_files_are_refused() -> Result<()> {
    let (before, after) = ("policy_preprocessor.json", "policy_postprocessor.json");
    let half = safetensors([("observation.state.min", Dtype::F16, [3], vec![0; 6])]);
    let state = |name: &str, values: &[f32]| statistics_with(&format!("observation.state.{name}"), values);
    let weights = older().0["model.safetensors"].clone();
    let cases = [
        ("a chunk", "policy.onnx", onnx::linear(3, 200, &[]), "a chunk of 100 actions of 2"),
        (
            "a longer action",
            "policy.onnx",
            onnx::linear(3, 3, &[]),
            "length of the action: the bundle contradicts itself",
        ),
        ("a longer state", "policy.onnx", onnx::linear(4, 2, &[]), "3 values in 1 observations"),
        (
            "two normalizers",
            "model.safetensors",
            weights,
            "normalization: the bundle contradicts itself: policy_preprocessor.json says",
        ),
        ("damaged statistics", STATE, vec![0xff; 4], "not a .safetensors file, or a truncated one"),
        ("no minimum", STATE, state("min", &[]), "it has no min of \"observation.state\""),
        (
            "a short minimum",
            STATE,
            state("min", &[1.0]),
            "length of \"observation.state\": the bundle contradicts itself",
        ),
        ("NaN", STATE, state("min", &[0.0, f32::NAN, 0.0]), "observation.state.min: value 1 (from 0) is NaN"),
        ("an endless range", STATE, state("max", &[f32::INFINITY, 1.0, 1.0]), "value 0 (from 0) is inf"),
        ("a reversed range", STATE, state("max", &[2.0, -5.0, 0.25]), "value 1 (from 0) is below the other end"),
        ("float16", STATE, half, "is of type float16; use float32, float64 or int64"),
        ("no steps", before, b"{\"steps\": []}".to_vec(), "must be a list of steps"),
        (
            "two rates",
            "train_config.json",
            TRAIN.into(),
            "meta/info.json: fps says 30, and train_config.json: env.fps says 20",
        ),
        ("two policies", "old/config.json", CONFIG.into(), "several policies of this family"),
    ];
    for (name, file, bytes, expected) in cases {
        refused_safely(name, &files().with_file(file, bytes), expected)?;
    }
    let cases = [
        ("no network", "policy.onnx", "there is no ONNX file; LeRobot saves weights only"),
        ("no processor", before, "there is no policy_preprocessor.json, and no model.safetensors"),
        ("one processor", after, "there is no policy_postprocessor.json"),
        ("no statistics", STATE, "state_file: there is no file"),
    ];
    for (name, file, expected) in cases {
        refused_safely(name, &files().without(file), expected)?;
    }
    Ok(())
}

#[test]
fn bad_answers_are_refused() -> Result<()> {
    let chunk = files().with_in("json", r#""n_action_steps": 1"#, r#""n_action_steps": 2"#);
    let random = chunk.with_in("json", r#""type": "act""#, r#""type": "tdmpc""#);
    for (files, answer) in [(&chunk, "replan = false"), (&random, "graph.complete = false")] {
        refused(answer, files.reading(true, answer), &format!("{answer}:"))?;
    }
    Ok(())
}

#[test]
fn an_answer_decides_between_two_rates() -> Result<()> {
    let reading = files().with_file("train_config.json", TRAIN).reading(true, "rate_hz = 20")?;
    assert_eq!(reading.description.rate_hz, 20.0);
    Ok(())
}

#[test]
fn unknown_keys_are_listed() -> Result<()> {
    let files = files().with_in("json", r#""device": "cuda""#, r#""device": "cuda", "new_key": 1"#);
    let reading = files.reading(true, "")?;
    assert_eq!(reading.unread, ["config.json: new_key"]);
    // That of a processor could change a number.
    assert_eq!(asked(&reading), ["unread.new_key"]);
    let settled = files.reading(true, "unread.new_key = \"unused\"")?;
    ensure!(settled.questions.is_empty(), "{:?}", settled.questions);
    Ok(())
}
