//! States that LEAPP's exports feed back: with any axes, and those of recurrent cells.

use actq::error::{Result, ensure};
use actq_deploy::description::Description;
use actq_testkit::f32_tensors;

use crate::common::made::{Files, message, refused};
use crate::common::onnx::{Lstm, shaped, weights};

/// A port: its name and shape.
type Port = (&'static str, &'static [usize]);

/// Returns the YAML file of one model, whose first input and output are the robot's. `flow` are lines of the feedback.
fn yaml(inputs: &[Port], outputs: &[Port], flow: &str, initial: bool) -> String {
    let ports = |ports: &[Port], kind: &str| {
        let port = |(i, (name, shape)): (usize, &Port)| {
            let kind = if i == 0 { format!("      kind: {kind}\n") } else { String::new() };
            format!("    - name: {name}\n      dtype: float32\n      shape: {shape:?}\n      type: tensor\n{kind}")
        };
        ports.iter().enumerate().map(port).collect::<String>()
    };
    let initial = if initial { "  initial_values: initial.safetensors\n" } else { "" };
    format!(
        "models:\n  policy:\n    inputs:\n{}    outputs:\n{}    parameters:\n      backend: onnx\n      model_path: \
         policy.onnx\npipeline:\n  configs:\n    frequency: 50\n  data_flow: {{}}\n  feedback_flow:\n{flow}{initial}  inputs:\n    \
         policy: [{}]\n  outputs:\n    policy: [{}]\nsystem information:\n  leapp config version: '1.3'\n",
        ports(inputs, "state/joint/position"),
        ports(outputs, "target/joint/torques"),
        inputs[0].0,
        outputs[0].0,
    )
}

fn bundle(yaml: &str, network: &[u8], initial: &[(&str, &[usize], &[f32])]) -> Files {
    Files::default()
        .with_file("pipe.yaml", yaml)
        .with_file("policy.onnx", network)
        .with_file("initial.safetensors", f32_tensors(initial.iter().copied()))
}

/// Asserts that 20 ticks give the targets of `reference`, which gets the raw input of each tick.
fn agrees(files: &Files, mut reference: impl FnMut(&[f64]) -> Vec<f64>) -> Result<Description> {
    let raw = |tick: usize| (0..4).map(|i| (0.37 * tick as f64 + 1.3 * f64::from(i)).sin()).collect::<Vec<f64>>();
    for (tick, (_, target)) in files.run("", 20, |_, _, tick| raw(tick))?.into_iter().enumerate() {
        let expected = reference(&raw(tick));
        let near = target.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-5 * (1.0 + b.abs()));
        ensure!(near && target.len() == expected.len(), "tick {tick}: {target:?}, not {expected:?}");
    }
    Ok(files.reading(true, "")?.description)
}

/// Returns the sum of inputs by weights, those of an input one after the other.
fn sum(values: &[f64], weights: &[f32], outputs: usize, j: usize) -> f64 {
    values.iter().enumerate().map(|(i, value)| f64::from(weights[i * outputs + j]) * value).sum()
}

/// Isaac Lab's histories are states of frames, then the batch, then values.
#[test]
fn states_may_have_any_axes() -> Result<()> {
    let inputs: [Port; 2] = [("q", &[1, 4]), ("memory_in", &[3, 1, 4])];
    let outputs: [Port; 2] = [("torque", &[1, 1, 4]), ("memory_out", &[3, 1, 4])];
    let network = shaped(
        &[
            ("Gemm", &["q", "weight", "bias"], &["own"], &[]),
            ("ReduceSum", &["memory_in"], &["all"], &[]),
            ("Add", &["own", "all"], &["torque"], &[]),
            ("Add", &["memory_in", "q"], &["moved"], &[]),
            ("Tanh", &["moved"], &["memory_out"], &[]),
        ],
        &[("weight", &[4, 4], weights(4, 4)), ("bias", &[4], vec![0.5; 4])],
        &inputs,
        &outputs,
        &[],
    );
    let start: Vec<f32> = (0..12_u8).map(|i| 0.1 * f32::from(i)).collect();
    let yaml = yaml(&inputs, &outputs, "    policy/memory_out: [policy/memory_in]\n", true);
    let files = bundle(&yaml, &network, &[("policy/memory_in", &[3, 1, 4], &start)]);
    let mut memory: Vec<f64> = start.iter().copied().map(f64::from).collect();
    agrees(&files, |q| {
        let all: f64 = memory.iter().sum();
        memory.iter_mut().enumerate().for_each(|(i, value)| *value = (*value + q[i % 4]).tanh());
        (0..4).map(|j| 0.5 + sum(q, &weights(4, 4), 4, j) + all).collect()
    })?;
    Ok(())
}

/// Hidden values of the LSTM.
const HIDDEN: usize = 2;
const LSTM_INPUTS: [Port; 3] = [("q", &[1, 1, 4]), ("h_in", &[1, 1, HIDDEN]), ("c_in", &[1, 1, HIDDEN])];
const LSTM_OUTPUTS: [Port; 3] = [("torque", &[1, 1, 4]), ("h_out", &[1, 1, HIDDEN]), ("c_out", &[1, 1, HIDDEN])];
const LSTM_FLOW: &str = "    policy/h_out: [policy/h_in]\n    policy/c_out: [policy/c_in]\n";

fn lstm() -> Vec<u8> {
    shaped(
        &[
            ("LSTM", &["q", "w", "r", "b", "", "h_in", "c_in"], &["y", "h_out", "c_out"], &[("hidden_size", HIDDEN)]),
            ("MatMul", &["h_out", "head"], &["torque"], &[]),
        ],
        &[
            ("w", &[1, 4 * HIDDEN, 4], weights(4 * HIDDEN, 4)),
            ("r", &[1, 4 * HIDDEN, HIDDEN], weights(4 * HIDDEN, HIDDEN)),
            ("b", &[1, 8 * HIDDEN], vec![0.1; 8 * HIDDEN]),
            ("head", &[HIDDEN, 4], weights(HIDDEN, 4).into_iter().map(|weight| 10.0 * weight).collect()),
        ],
        &LSTM_INPUTS,
        &LSTM_OUTPUTS,
        &[],
    )
}

#[test]
fn cells_keep_their_states() -> Result<()> {
    let files = bundle(&yaml(&LSTM_INPUTS, &LSTM_OUTPUTS, LSTM_FLOW, false), &lstm(), &[]);
    let mut cell = Lstm::new(4, HIDDEN);
    let description = agrees(&files, |q| {
        let h = cell.step(q);
        (0..4).map(|j| 10.0 * sum(&h, &weights(HIDDEN, 4), 4, j)).collect()
    })?;
    ensure!(description.states.is_empty(), "{:?}", description.states);
    Ok(())
}

#[test]
fn cells_that_the_pipeline_feeds_otherwise_are_refused() -> Result<()> {
    let crossed = "    policy/h_out: [policy/c_in]\n    policy/c_out: [policy/h_in]\n";
    let error = message(bundle(&yaml(&LSTM_INPUTS, &LSTM_OUTPUTS, crossed, false), &lstm(), &[]).reading(true, ""));
    let both = error.contains("pipeline.feedback_flow.policy/") && error.contains("policy.onnx says the output");
    ensure!(error.contains("next value of") && both, "{error}");
    let yaml = yaml(&LSTM_INPUTS, &LSTM_OUTPUTS, LSTM_FLOW, true);
    let files = bundle(&yaml, &lstm(), &[("policy/h_in", &[1, 1, HIDDEN], &[0.0, 0.5])]);
    let expected = "initial.safetensors: policy/h_in: the state of an LSTM or GRU starts at 0";
    refused("first values", files.reading(true, ""), expected)
}
