//! A pipeline of two models as LEAPP writes it, and the arithmetic of its runtime.

use actq::error::Result;
use actq_testkit::f32_tensors;

use super::made::Files;
use super::onnx::{graph, weights};

/// The YAML file.
pub(crate) const YAML: &str = "\
models:
  observe:
    inputs:
    - name: robot_joint_pos
      dtype: float32
      shape: [1, 4]
      type: tensor
      kind: state/joint/position
      element_names: [[FL_hip, FR_hip, FL_knee, FR_knee]]
      isaaclab_connection: state:robot:joint_pos
    - name: robot_joint_vel
      dtype: float32
      shape: [1, 4]
      type: tensor
      kind: state/joint/velocity
      element_names: [[FL_hip, FR_hip, FL_knee, FR_knee]]
    - name: last_action_in
      dtype: float32
      shape: [1, 4]
      type: tensor
      is_state: true
    - name: smooth_in
      dtype: float32
      shape: [1, 4]
      type: tensor
    outputs:
    - name: position
      dtype: float32
      shape: [1, 4]
      type: tensor
    - name: last
      dtype: float32
      shape: [1, 4]
      type: tensor
    - name: smooth_out
      dtype: float32
      shape: [1, 4]
      type: tensor
    parameters:
      backend: onnx
      model_path: observe.onnx
      md5sum: 0
      sha256sum: HASH walker/observe.onnx
      opset_version: 13
  policy:
    inputs:
    - name: position
      dtype: float32
      shape: [1, 4]
      type: tensor
    - name: smooth
      dtype: float32
      shape: [1, 4]
      type: tensor
    - name: last
      dtype: float32
      shape: [1, 4]
      type: tensor
    - name: base_velocity
      dtype: float32
      shape: [1, 3]
      type: tensor
      kind: command/body/velocity
      element_names: [[lin_vel_x, lin_vel_y, ang_vel_z]]
      units: m/s
    outputs:
    - name: joint_pos
      dtype: float32
      shape: [1, 4]
      type: tensor
      kind: target/joint/position
      element_names: [[FR_hip, FR_knee, FL_hip, FL_knee]]
    - name: last_action_out
      dtype: float32
      shape: [1, 4]
      type: tensor
    - name: joint_pos_kp_gains
      dtype: float32
      shape: [1, 4]
      type: tensor
      kind: kp
      element_names: [[FR_hip, FR_knee, FL_hip, FL_knee]]
    - name: joint_pos_kd_gains
      dtype: float32
      shape: [1, 4]
      type: tensor
      kind: kd
      element_names: [[FR_hip, FR_knee, FL_hip, FL_knee]]
    parameters:
      backend: onnx
      model_path: policy.onnx
      md5sum: 0
      sha256sum: HASH walker/policy.onnx
      tensorrt_compatible: true

pipeline:
  configs:
    frequency: 50
  data_flow:
    observe/last: [policy/last]
    observe/position: [policy/position]
    observe/smooth_out: [policy/smooth]
  feedback_flow:
    observe/smooth_out: [observe/smooth_in]
    policy/last_action_out: [observe/last_action_in]
  initial_values: walker_initial_values.safetensors
  inputs:
    observe: [robot_joint_pos, robot_joint_vel]
    policy: [base_velocity]
  outputs:
    policy: [joint_pos, joint_pos_kp_gains, joint_pos_kd_gains]

system information:
  leapp config version: '1.3'
  leapp version: 0.7.1
";

const DEFAULT: [f32; 4] = [0.1, -0.1, 0.5, -1.5];
const OFFSET: [f32; 4] = [-0.1, -1.5, 0.1, 0.5];
const SCALE: [f32; 4] = [0.25, 0.5, 0.25, 0.5];
const BIAS: [f32; 4] = [0.1, -0.2, 0.3, 0.05];
pub(crate) const SMOOTH: [f32; 4] = [0.75, -0.5, 2.0, 0.25];
pub(crate) const KP: [f32; 4] = [25.0, 30.0, 25.0, 30.0];
pub(crate) const KD: [f32; 4] = [0.5, 0.75, 0.5, 0.75];

/// File of the first values.
pub(crate) const INITIAL: &str = "walker/walker_initial_values.safetensors";

pub(crate) fn walker() -> Files {
    Files::default()
        .with_file("walker/walker.yaml", YAML)
        .with_file("walker/observe.onnx", observe())
        .with_file("walker/policy.onnx", policy("stiffness"))
        .with_file(INITIAL, initial(&[("observe/last_action_in", [0.0; 4]), ("observe/smooth_in", SMOOTH)]))
}

/// Runs 20 ticks; returns the targets of each.
pub(crate) fn run(files: &Files, answers: &str) -> Result<Vec<Vec<f64>>> {
    Ok(files.run(answers, 20, raw)?.into_iter().map(|(_, targets)| targets).collect())
}

/// Returns first values of inputs, which are `[1, 4]`.
pub(crate) fn initial(tensors: &[(&str, [f32; 4])]) -> Vec<u8> {
    f32_tensors(tensors.iter().map(|(name, values)| (name, [1, 4], values)))
}

/// The model that prepares what the policy reads.
fn observe() -> Vec<u8> {
    let nodes = [
        ("Sub", &["robot_joint_pos", "default"][..], "position"),
        ("Mul", &["last_action_in", "half"], "last"),
        ("Mul", &["smooth_in", "half"], "before"),
        ("Mul", &["robot_joint_vel", "quarter"], "now"),
        ("Add", &["before", "now"], "smooth_out"),
    ];
    let tensors = [("default", &[4][..], DEFAULT.to_vec()), ("half", &[1], vec![0.5]), ("quarter", &[1], vec![0.25])];
    let inputs = [("robot_joint_pos", 4), ("robot_joint_vel", 4), ("last_action_in", 4), ("smooth_in", 4)];
    graph(&nodes, &tensors, &inputs, &[("position", 4), ("last", 4), ("smooth_out", 4)], &[])
}

/// The policy; its stiffness is a copy of `gain`: a constant, or a value that it computes.
pub(crate) fn policy(gain: &str) -> Vec<u8> {
    let gain = [gain];
    let nodes = [
        ("Gemm", &["position", "w0", "bias"][..], "p"),
        ("MatMul", &["smooth", "w1"], "s"),
        ("MatMul", &["last", "w2"], "l"),
        ("MatMul", &["base_velocity", "w3"], "c"),
        ("Add", &["p", "s"], "ps"),
        ("Add", &["ps", "l"], "psl"),
        ("Add", &["psl", "c"], "all"),
        ("Tanh", &["all"], "last_action_out"),
        ("Mul", &["last_action_out", "scale"], "scaled"),
        ("Add", &["scaled", "offset"], "joint_pos"),
        ("Identity", &gain, "joint_pos_kp_gains"),
        ("Identity", &["damping"], "joint_pos_kd_gains"),
    ];
    let tensors = [
        ("w0", &[4, 4][..], weights(4, 4)),
        ("w1", &[4, 4], weights(4, 4).into_iter().map(|w| 3.0 * w).collect()),
        ("w2", &[4, 4], weights(4, 4).into_iter().map(|w| -2.0 * w).collect()),
        ("w3", &[3, 4], weights(3, 4)),
        ("bias", &[4], BIAS.to_vec()),
        ("scale", &[4], SCALE.to_vec()),
        ("offset", &[4], OFFSET.to_vec()),
        ("stiffness", &[1, 4], KP.to_vec()),
        ("damping", &[1, 4], KD.to_vec()),
    ];
    let inputs = [("position", 4), ("smooth", 4), ("last", 4), ("base_velocity", 3)];
    let outputs = [("joint_pos", 4), ("last_action_out", 4), ("joint_pos_kp_gains", 4), ("joint_pos_kd_gains", 4)];
    graph(&nodes, &tensors, &inputs, &outputs, &[])
}

/// Returns a raw value of a tick.
pub(crate) fn raw(name: &str, len: usize, tick: usize) -> Vec<f64> {
    (0..len).map(|i| (name.len() as f64 + 0.37 * tick as f64 + 1.3 * i as f64).sin()).collect()
}

/// Computes targets as `InferenceManager.run_policy` does: the models in their order, each output passed on at
/// once, so that an input of an earlier model reads it in the next tick. `last` and `smooth` are the first values.
pub(crate) fn reference(mut last: Vec<f64>, mut smooth: Vec<f64>, ticks: usize) -> Vec<Vec<f64>> {
    let sum = |values: &[f64], factor: f64, j: usize| {
        let weights = weights(values.len(), 4);
        values.iter().enumerate().map(|(i, value)| factor * f64::from(weights[4 * i + j]) * value).sum::<f64>()
    };
    let mut all = Vec::new();
    for tick in 0..ticks {
        let (q, dq) = (raw("robot_joint_pos", 4, tick), raw("robot_joint_vel", 4, tick));
        let command = raw("base_velocity", 3, tick);
        let position: Vec<f64> = q.iter().zip(DEFAULT).map(|(q, default)| q - f64::from(default)).collect();
        let half: Vec<f64> = last.iter().map(|value| 0.5 * value).collect();
        smooth = smooth.iter().zip(&dq).map(|(before, dq)| 0.5 * before + 0.25 * dq).collect();
        let action = |j: usize| {
            let inputs = sum(&position, 1.0, j) + sum(&smooth, 3.0, j) + sum(&half, -2.0, j) + sum(&command, 1.0, j);
            (f64::from(BIAS[j]) + inputs).tanh()
        };
        last = (0..4).map(action).collect();
        all.push((0..4).map(|j| f64::from(SCALE[j]) * last[j] + f64::from(OFFSET[j])).collect());
    }
    all
}
