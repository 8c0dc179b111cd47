//! Files of LeRobot's policies that contradict each other, are damaged, or are not supported.

use actq::error::{Result, ensure};
use safetensors::Dtype;
use safetensors::tensor::{TensorView, serialize};

use crate::common::lerobot::{CONFIG, Files, STATE_FILES, with_statistic};
use crate::common::made::message;
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
    let files = with_statistic(STATE_FILES[0], "observation.state.std", &[0.5, 2.0, 1.0])?;
    let files = files.with(r#""STATE": "MIN_MAX""#, r#""STATE": "MEAN_STD""#)?;
    let other = with_statistic(STATE_FILES[1], "action.std", &[3.0, 4.0])?;
    let mut files = files;
    files.0.insert(STATE_FILES[1].to_owned(), other.0[STATE_FILES[1]].clone());
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
    let with = |nodes: &[(&str, &[&str], &str)]| {
        message(files.with_file("policy.onnx", &normalizing(nodes)).reading(true, ""))
    };
    for (graph, part) in [
        (with(&first), "policy.onnx says that the graph normalizes with the same numbers"),
        (with(&last), "policy.onnx says that the graph reverses it with the same numbers"),
    ] {
        ensure!(graph.contains(part) && graph.contains("that it is outside of the network"), "{graph}");
    }
    ensure!(with(&plain).starts_with("accepted"), "{}", with(&plain));
    Ok(())
}

#[test]
fn bad_files_are_refused() -> Result<()> {
    let files = Files::new()?;
    let (before, after, config) = ("policy_preprocessor.json", "policy_postprocessor.json", "config.json");
    let state = |name: &str, values: &[f32]| with_statistic(STATE_FILES[0], name, values);
    let image = r#""input_features": {"observation.images.top": {"type": "VISUAL", "shape": [3, 480, 640]},"#;
    let other = r#""input_features": {"observation.audio": {"type": "AUDIO", "shape": [3]},"#;
    let train = r#"{"env": {"type": "gym", "fps": 20}}"#;
    let half = [("observation.state.min", Dtype::F16, vec![3], vec![0; 6])];
    let half =
        half.iter().map(|(name, dtype, shape, bytes)| Ok((*name, TensorView::new(*dtype, shape.clone(), bytes)?)));
    let half = serialize(half.collect::<Result<Vec<_>>>()?, None)?;
    let weights = Files::older()?.0["model.safetensors"].clone();
    let cases = [
        (
            "an image",
            files.with(r#""input_features": {"#, image)?,
            "config.json: input_features.observation.images.top is an image [3, 480, 640]",
        ),
        (
            "sound",
            files.with(r#""input_features": {"#, other)?,
            "the type \"AUDIO\" is not supported; STATE and ENV are",
        ),
        (
            "no features",
            files.with(r#""input_features": {"#, r#""input_features": null, "x": {"#)?,
            "it has no features",
        ),
        (
            "a shape of two lengths",
            files.with_in(config, "                3\n", "                3, 2\n")?,
            "shape = [3, 2]: give one length",
        ),
        (
            "no length",
            files.with_in(config, "                3\n", "                0\n")?,
            "must be a list of lengths above 0",
        ),
        (
            "two outputs",
            files.with(r#""output_features": {"#, r#""output_features": {"x": {"type": "ACTION", "shape": [1]},"#)?,
            "it has 2 features",
        ),
        (
            "another output",
            files.with_in(config, r#""action": {"#, r#""torque": {"#)?,
            "the only output must be \"action\"",
        ),
        ("no network", files.without("policy.onnx"), "there is no ONNX file; LeRobot saves weights only"),
        ("no type", files.with_in(config, r#""type": "act""#, r#""kind": "act""#)?, "config.json: type is missing"),
        (
            "temporal ensembling",
            files.with(r#""temporal_ensemble_coeff": null"#, r#""temporal_ensemble_coeff": 0.01"#)?,
            "average the actions of several chunks",
        ),
        ("a chunk", files.with_file("policy.onnx", &onnx::linear(3, 200, &[])), "a chunk of 100 actions of 2"),
        (
            "a longer action",
            files.with_file("policy.onnx", &onnx::linear(3, 3, &[])),
            "length of the action: the bundle contradicts itself",
        ),
        ("a longer state", files.with_file("policy.onnx", &onnx::linear(4, 2, &[])), "3 values in 1 observations"),
        (
            "no history in the graph",
            files.with(r#""n_obs_steps": 1"#, r#""n_obs_steps": 2"#)?,
            "6 values in 2 observations",
        ),
        (
            "no observations",
            files.with(r#""n_obs_steps": 1"#, r#""n_obs_steps": 0"#)?,
            "must be a number of observations",
        ),
        ("no processor", files.without(before), "there is no policy_preprocessor.json, and no model.safetensors"),
        ("one processor", files.without(after), "there is no policy_postprocessor.json"),
        (
            "two normalizers",
            files.with_file("model.safetensors", &weights),
            "normalization: the bundle contradicts itself: policy_preprocessor.json says",
        ),
        ("no statistics", files.without(STATE_FILES[0]), "state_file: there is no file"),
        ("statistics outside", files.with_in(before, "\"policy_preprocessor_step_3", "\"../x_step_3")?, "without .."),
        (
            "no state file",
            files.with_in(before, "state_file", "state_files")?,
            "policy_preprocessor.json step 3: it has no min of \"observation.state\"",
        ),
        (
            "damaged statistics",
            files.with_file(STATE_FILES[0], b"\xff\xff\xff\xff"),
            "not a .safetensors file, or a truncated one",
        ),
        ("no minimum", state("observation.state.min", &[])?, "it has no min of \"observation.state\""),
        (
            "a short minimum",
            state("observation.state.min", &[1.0])?,
            "length of \"observation.state\": the bundle contradicts itself",
        ),
        (
            "NaN",
            state("observation.state.min", &[0.0, f32::NAN, 0.0])?,
            "observation.state.min: value 1 (the first is 0) is NaN",
        ),
        (
            "an endless range",
            state("observation.state.max", &[f32::INFINITY, 1.0, 1.0])?,
            "value 0 (the first is 0) is inf",
        ),
        (
            "a reversed range",
            state("observation.state.max", &[2.0, -5.0, 0.25])?,
            "value 1 (the first is 0) is below the other end",
        ),
        ("float16", files.with_file(STATE_FILES[0], &half), "is of type float16; use float32, float64 or int64"),
        ("eps of 0", files.with_in(before, "1e-08", "0.0")?, "value 2 (the first is 0) gives a division by 0"),
        ("eps of NaN", files.with_in(before, "1e-08", "NaN")?, "config.eps (line 24) must be a finite number"),
        ("a large eps", files.with_in(before, "1e-08", "2.0")?, "give a number from 0 to below 1"),
        (
            "two modes",
            files.with_in(config, r#""STATE": "MIN_MAX""#, r#""STATE": "MEAN_STD""#)?,
            "config.json: normalization_mapping.STATE says MEAN_STD, and policy_preprocessor.json step 3: config.norm_map.STATE says MIN_MAX",
        ),
        ("an unknown mode", files.with(r#""STATE": "MIN_MAX""#, r#""STATE": "LOG""#)?, "\"LOG\": give IDENTITY"),
        (
            "two shapes",
            files.with_in(before, "              3\n", "              4\n")?,
            "shape of \"observation.state\": the bundle contradicts itself",
        ),
        (
            "a feature less",
            files.with_in(before, "observation.state", "observation.other")?,
            "that there is no such feature",
        ),
        (
            "an unknown step",
            files.with_in(before, "to_batch_processor", "tokenizer_processor")?,
            "\"tokenizer_processor\" is not supported",
        ),
        (
            "half precision",
            files.with_in(before, r#""float_dtype": null"#, r#""float_dtype": "float16""#)?,
            "only float32 is supported",
        ),
        (
            "no normalizer",
            files.with_in(after, "unnormalizer_processor\"", "device_processor\"")?,
            "none of its steps is unnormalizer_processor",
        ),
        (
            "statistics in the step",
            files.with_in(before, r#""eps": 1e-08"#, r#""eps": 1e-08, "stats": {"a": 1}"#)?,
            "it takes the place of the state_file",
        ),
        ("no steps", files.with_file(before, b"{\"steps\": []}"), "must be a list of steps"),
        (
            "two rates",
            files.with_file("train_config.json", train.as_bytes()),
            "meta/info.json: fps says 30, and train_config.json: env.fps says 20",
        ),
        ("no rate", files.with(r#""fps": 30"#, r#""fps": 0"#)?, "give a number above 0"),
        (
            "a name less",
            files.with_in("meta/info.json", "                \"lift.pos\",\n", "")?,
            "number of values of \"observation.state\"",
        ),
        ("a name twice", files.with_in("meta/info.json", "lift.pos", "pan.pos")?, "\"pan.pos\" occurs twice"),
        (
            "another dataset",
            files.with_in("meta/info.json", "                3\n", "                4\n")?,
            "shape of \"observation.state\"",
        ),
        ("a key twice", files.with_in(config, r#""use_amp": false"#, r#""device": "cpu""#)?, "occurs twice"),
        ("two policies", files.with_file("old/config.json", CONFIG.as_bytes()), "several policies of this family"),
        (
            "a control character",
            files.with_in(config, r#""type": "AC"#, r#""type": "\u001b[2J"#)?,
            "the only output must be",
        ),
    ];
    for (name, files, expected) in cases {
        let error = message(files.reading(true, ""));
        ensure!(error.contains(expected) && !error.contains('\u{1b}'), "{name}: {error}");
    }
    for answers in ["replan = false", "graph.complete = false"] {
        let files = files.with(r#""n_action_steps": 1"#, r#""n_action_steps": 2"#)?;
        let files =
            if answers.starts_with('g') { files.with(r#""type": "act""#, r#""type": "tdmpc""#)? } else { files };
        let error = message(files.reading(true, answers));
        ensure!(error.contains(&format!("{answers}:")), "{error}");
    }
    let rate = files.with_file("train_config.json", train.as_bytes()).reading(true, "rate_hz = 20")?;
    ensure!(rate.description.rate_hz == 20.0, "the answer decides");
    Ok(())
}

#[test]
fn unknown_keys_are_listed() -> Result<()> {
    let files = Files::new()?.with(r#""device": "cuda""#, r#""device": "cuda", "new_key": 1"#)?;
    let unread = files.reading(true, "")?.unread;
    assert_eq!(unread, ["config.json: new_key", "policy_preprocessor.json step 2: config.new_key"]);
    Ok(())
}
