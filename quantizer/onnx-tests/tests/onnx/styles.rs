//! Each style in which exporters write a policy, against tract.

use actq::data::{Recording, Sizes};
use actq_bench::shared_policies;
use actq_onnx::{Choice, Onnx};
use anyhow::{Context as _, Result};
use proptest::prelude::*;

use super::file::{File, encoded, tensor};
use super::{by_tract, compare, drawn, imported, refused, same};
use actq::import::Importer as _;
use actq::measure::actions::actions;
use actq::policy::Policy;
use actq_onnx::import;

/// Values of the observation, in texts of the notation 11.
pub(super) const OBS: usize = 11;

pub(super) fn begun() -> File {
    let mut file = File::default();
    file.input("obs", &[1, OBS as i64]);
    file
}

/// Adds a last layer and the output `actions`.
pub(super) fn ended(mut file: File, last: &str, len: usize) -> Vec<u8> {
    let y = file.gemm(last, 3, len);
    file.nodes("Identity", &[&y], &["actions"], &[]);
    file.output("actions", &[1, 3]);
    file.bytes()
}

/// Writes a network of the observation, whose last value has `len` elements, and a last layer.
pub(super) fn network(text: &str, len: usize) -> Vec<u8> {
    let mut file = begun();
    let last = file.write(&[], text);
    ended(file, &last, len)
}

/// Writes a network of the observation whose outputs are `actions`, of `len` elements.
pub(super) fn whole(text: &str, len: i64) -> File {
    let mut file = begun();
    file.write(&[], text);
    file.output("actions", &[1, len]);
    file
}

pub(super) fn ops(bytes: &[u8]) -> Result<String> {
    Ok(same(bytes)?.ops.join(" "))
}

/// Returns the ops of a [`network`].
pub(super) fn found(text: &str, len: usize) -> Result<String> {
    ops(&network(text, len)).with_context(|| text.to_owned())
}

/// Requires these ops between two layers for each text, in which `x` is the first layer's output of 16 values.
pub(super) fn between(cases: &[(&str, &str)]) -> Result<()> {
    for (expected, text) in cases {
        let found = found(&format!("x = gemm(obs, 16, 11)\n{text}"), 16)?;
        assert_eq!(found, format!("linear {expected} linear"), "{text}");
    }
    Ok(())
}

#[test]
fn normalizers_and_layers_become_native_operations() -> Result<()> {
    // rsl_rl: Sub, Div, Gemm, Elu.
    let ops_of_rsl_rl = found("Elu(gemm((obs - drawn(1, 11)) / full(1.5, 1, 11), 16, 11), alpha=1.0)", 16)?;
    assert_eq!(ops_of_rsl_rl, "normalize linear elu linear");
    // Brax: weights [in, out], the bias on the left, SiLU in its parts, half of the last layer unused, tanh.
    let brax = whole(
        "x = drawn(16) + MatMul(obs, drawn(11, 16))
         loc, scale := Split(gemm(Sigmoid(x) * x, 8, 16), [4, 4], axis=1)
         actions := Tanh(loc)",
        4,
    );
    assert_eq!(ops(&brax.bytes())?, "linear silu linear tanh");
    Ok(())
}

#[test]
fn final_factors_and_limits_become_the_contract() -> Result<()> {
    // Stable-Baselines3: flatten, tanh, clip; then to the robot's range.
    let text = "actions := Clip(Tanh(gemm(Flatten(obs), 3, 11)), -0.5, 0.5) * 2.0 + 0.5";
    let imported = same(&whole(text, 3).bytes())?;
    assert_eq!(imported.ops, ["linear", "tanh"]);
    assert_eq!(imported.contract, ["scale", "offset", "low", "high"]);
    // A joint that is held still.
    let held = whole("actions := Concat(gemm(obs, 3, 11), full(0.7, 1, 1), axis=1)", 4);
    assert_eq!(same(&held.bytes())?.contract, ["scale", "offset"]);
    Ok(())
}

#[test]
fn every_activation_is_native_or_composed() -> Result<()> {
    between(&[
        ("relu", "Relu(x)"),
        ("elu", "Elu(x)"),
        ("tanh", "Tanh(x)"),
        ("sigmoid", "Sigmoid(x)"),
        ("softplus", "Softplus(x)"),
        ("relu normalize add", "LeakyRelu(x)"),
        ("elu relu normalize add", "Selu(x)"),
        ("normalize normalize mul", "HardSwish(x)"),
        ("exp", "Exp(x)"),
        ("sin", "Sin(x)"),
        ("cos", "Cos(x)"),
        ("relu normalize relu add", "Abs(x)"),
    ])
}

/// The ops of each, and the nodes that exporters make of it.
pub(super) const ACTIVATIONS: [(&str, &str); 10] = [
    // jax.nn.gelu: 1 - erf(-x / sqrt 2)
    ("gelu", "0.5 * (x * (1.0 - Erf(Neg(x) * 0.70710677)))"),
    ("gelu", "x * (Erf(x / 1.4142135) + 1.0) * 0.5"),
    ("gelu_tanh", "x * 0.5 * (1.0 + Tanh((x + Pow(x, 3.0) * 0.044715) * 0.7978846))"),
    // TensorFlow: half of x first.
    ("gelu", "0.5 * x * (Erf(x / 1.4142135) + 1.0)"),
    ("gelu", "x * (0.5 + Erf(x / 1.4142135) * 0.5)"),
    // Beside the residual that reads the same value.
    ("gelu add", "0.5 * x * (Erf(x / 1.4142135) + 1.0) + x"),
    ("mish", "x * Tanh(Softplus(x))"),
    ("silu", "x / (Exp(Neg(x)) + 1.0)"),
    ("softplus", "Log(Exp(x) + 1.0)"),
    ("elu", "Where(Greater(x, 0.0), x, Exp(x) - 1.0)"),
];

#[test]
fn activations_in_their_parts_are_found() -> Result<()> {
    between(&ACTIVATIONS)
}

#[test]
fn recurrent_cells_carry_their_states() -> Result<()> {
    const H: i64 = 8;
    for (op, states, text) in [
        (
            "lstm",
            &[("h_in", "h_out"), ("c_in", "c_out")][..],
            "w = drawn(1, 32, 11)
             y, h_out, c_out := LSTM(Unsqueeze(obs, [0]), w, drawn(1, 32, 8), drawn(1, 64), , h_in, c_in, hidden_size=8)
             Reshape(y, [1, 8])",
        ),
        (
            "gru",
            &[("h_in", "h_out")],
            "w = drawn(1, 24, 11)
             y, h_out := GRU(Unsqueeze(obs, [0]), w, drawn(1, 24, 8), drawn(1, 48), , h_in, hidden_size=8, linear_before_reset=1)
             Reshape(y, [1, 8])",
        ),
    ] {
        let mut file = begun();
        for (state, next) in states {
            file.input(state, &[1, 1, H]);
            file.output(next, &[1, 1, H]);
        }
        let y = file.write(&[], text);
        let imported = same(&ended(file, &y, H as usize)).with_context(|| op.to_owned())?;
        assert_eq!(imported.ops, [op, "linear"]);
        assert_eq!(imported.states.len(), states.len());
        assert_eq!(imported.inputs, [("obs".to_owned(), OBS)]);
    }
    Ok(())
}

#[test]
fn cells_in_their_parts_are_found() -> Result<()> {
    const H: i64 = 8;
    // `x W + h U + b`, sliced into gates.
    for (expected, states, text) in [
        (
            "lstm linear",
            &[("h_in", "h_out"), ("c_in", "c_out")][..],
            "i, f, g, o := Split(gemm(obs, 32, 11) + gemm(h_in, 32, 8), axis=1)
             c_out := Sigmoid(f) * c_in + Sigmoid(i) * Tanh(g)
             h_out := Sigmoid(o) * Tanh(c_out)",
        ),
        (
            "gru linear",
            &[("h_in", "h_out")],
            "r, z := Split(gemm(obs, 16, 11) + gemm(h_in, 16, 8), axis=1)
             r = Sigmoid(r)
             z = Sigmoid(z)
             n = Tanh(gemm(obs, 8, 11) + r * gemm(h_in, 8, 8))
             h_out := (1.0 - z) * n + z * h_in",
        ),
    ] {
        let mut file = begun();
        for (state, next) in states {
            file.input(state, &[1, H]);
            file.output(next, &[1, H]);
        }
        file.write(&[], text);
        assert_eq!(ops(&ended(file, "h_out", H as usize))?, expected);
    }
    Ok(())
}

#[test]
fn inputs_join_in_order_and_dead_nodes_vanish() -> Result<()> {
    let mut file = File::default();
    file.input("masks", &[1, 2]);
    file.input("obs_0", &[-1, 4]);
    file.input("obs_1", &[-1, 3]);
    // A batch size read from the input.
    file.write(
        &[],
        "shape = Concat(Gather(Shape(obs_0), [0], axis=0), [4], axis=0)
         y = gemm(Concat(obs_1, Reshape(obs_0, shape), axis=1), 3, 7)
         version_number := Identity([3.0])
         continuous_actions := Identity(y + RandomNormal(shape=[1, 3]))
         deterministic_continuous_actions := Identity(y)",
    );
    file.output("version_number", &[1]);
    file.output("continuous_actions", &[-1, 3]);
    file.output("deterministic_continuous_actions", &[-1, 3]);
    let bytes = file.bytes();
    let imported = same(&bytes)?;
    assert_eq!(imported.inputs, [("obs_0".to_owned(), 4), ("obs_1".to_owned(), 3)]);
    assert_eq!(imported.output.0, "deterministic_continuous_actions");
    assert_eq!(imported.cut_inputs, ["masks"]);
    assert_eq!(imported.cut_outputs, ["version_number", "continuous_actions"]);
    // An explicit request is not replaced by another possible choice.
    let choice = Choice { output: Some("continuous_actions".to_owned()), ..Choice::default() };
    let error = format!("{:#}", super::imported(&bytes, &choice).expect_err("random"));
    assert!(error.contains("draws random numbers"), "{error}");
    Ok(())
}

#[test]
fn unbatched_products_and_external_data_are_imported() -> Result<()> {
    // Isaac Gym: rank 1, MatMul and Add.
    let mut file = File::default();
    file.input("x", &[5]);
    file.write(&["x"], "y := drawn(3) + MatMul(x, drawn(5, 3))");
    file.output("y", &[3]);
    same(&file.bytes())?;
    // A gate beside a value, and slices of the observation.
    let gated = "gemm(obs, 6, 11) * Sigmoid(gemm(obs, 6, 11))";
    assert!(found(&format!("Concat(Slice(obs, [2], [9], [1]), {gated}, axis=-1)"), 13)?.contains("mul"));
    // Weights in a file of the model's folder.
    let dir = tempfile::TempDir::new()?;
    let data: Vec<f32> = (0..3 * OBS).map(|i| i as f32 / 20.0 - 0.7).collect();
    let mut file = begun();
    let entry = |key: &str, value: &str| {
        encoded(&actq_onnx::proto::Entry { key: Some(key.to_owned()), value: Some(value.to_owned()) })
    };
    let outside = actq_onnx::proto::Tensor {
        raw_data: None,
        external_data: vec![entry("location", "model.data"), entry("offset", "16")],
        data_location: Some(1),
        ..tensor("w", &[OBS, 3], &data)
    };
    file.initializer(&outside);
    file.nodes("MatMul", &["obs", "w"], &["actions"], &[]);
    file.output("actions", &[1, 3]);
    let bytes: Vec<u8> = [vec![0; 16], data.iter().flat_map(|v| v.to_le_bytes()).collect()].concat();
    std::fs::write(dir.path().join("model.data"), bytes)?;
    let path = dir.path().join("model.onnx");
    std::fs::write(&path, file.bytes())?;
    let policy = Onnx.load(&path)?;
    let obs: Vec<f32> = (0..OBS).map(|i| i as f32).collect();
    let expected = (0..3).map(|k| (0..OBS).map(|i| obs[i] * data[3 * i + k]).sum()).collect();
    compare(&[expected], &actions(&policy, &[obs]))
}

#[test]
fn published_files_are_imported() -> Result<()> {
    let Some(policies) = shared_policies() else { return Ok(()) };
    let folder = policies.with_file_name("onnx");
    for (name, expected) in [
        ("brax_go1", "normalize linear silu linear silu linear silu linear tanh"),
        ("mjlab_mecanum", "normalize linear elu linear elu linear elu linear"),
        ("limx_tron1_pf", "linear elu linear elu linear elu linear"),
    ] {
        let path = folder.join(name).join("model.onnx");
        let bytes = std::fs::read(&path)?;
        let file = import(&path, &Choice::default())?;
        assert_eq!(file.ops.join(" "), expected);
        let policy = Onnx.load(&path)?;
        // Uses the recording if there is one: beyond its path, sums of random values lose more digits than the
        // tolerance allows.
        let observations = match name {
            "brax_go1" => {
                let recorded =
                    Recording::Calib.require(Some(&policies.join("go1_mlp")), None, Sizes::of(&policy), "this test")?;
                recorded.episode(0).take(64).collect()
            }
            _ => drawn(&policy),
        };
        compare(&by_tract(&bytes, &file, &observations)?, &actions(&policy, &observations))
            .with_context(|| name.to_owned())?;
    }
    // The same network, imported by another tool.
    let [ours, theirs] = [folder.join("brax_go1/model.onnx"), policies.join("go1_mlp")]
        .map(|path| if path.is_dir() { Policy::load(&path) } else { Onnx.load(&path) })
        .map(Result::unwrap);
    assert_eq!(ours.graph.matrices.len(), theirs.graph.matrices.len());
    for (a, b) in ours.graph.matrices.iter().zip(&theirs.graph.matrices) {
        assert_eq!((a.rows, a.cols, &a.data), (b.rows, b.cols, &b.data));
    }
    let observations = drawn(&ours);
    assert_eq!(actions(&ours, &observations), actions(&theirs, &observations));
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// A chain of random nodes, some joined with earlier values.
    #[test]
    fn random_graphs_agree_with_tract(steps in prop::collection::vec((0usize..14, any::<bool>()), 1..9), batch in any::<bool>()) {
        let mut file = File::default();
        file.input("obs", &[if batch { -1 } else { 1 }, OBS as i64]);
        let mut at = "obs".to_owned();
        let mut len = OBS;
        let mut before: Option<(String, usize)> = None;
        for (which, keep) in steps {
            let kept = (at.clone(), len);
            at = match which {
                0..=3 => {
                    let rows = 4 + 3 * which;
                    let y = file.gemm(&at, rows, len);
                    len = rows;
                    y
                }
                4 => file.write(&[&at], "Tanh(x)"),
                5 => file.write(&[&at], "Elu(x)"),
                6 => file.write(&[&at], "Sin(x)"),
                7 => file.write(&[&at], &format!("x * drawn({len})")),
                8 => file.write(&[&at], &format!("drawn(1, {len}) - x")),
                9 => file.write(&[&at], "Clip(x, -0.6, 0.9)"),
                10 => file.write(&[&at], "x * Sigmoid(x)"),
                11 => file.write(&[&at], &format!("LayerNormalization(x, drawn({len}), drawn({len}), axis=-1, epsilon=1e-2)")),
                12 => file.write(&[&at], "LeakyRelu(x, alpha=0.2)"),
                _ => match &before {
                    Some((other, n)) if *n == len => file.write(&[&at, other], if keep { "x + y" } else { "x * y" }),
                    Some((other, n)) => {
                        len += n;
                        file.write(&[other, &at], "Concat(x, y, axis=1)")
                    }
                    None => file.write(&[&at], "Relu(x)"),
                },
            };
            if keep {
                before = Some(kept);
            }
        }
        let bytes = ended(file, &at, len);
        let result = same(&bytes);
        prop_assert!(result.is_ok(), "{:?}", result.err());
    }
}

#[test]
fn ambiguous_action_outputs_are_refused() -> Result<()> {
    let with_outputs = |names: [&str; 2], text: &str| {
        let mut file = begun();
        file.write(&[], text);
        names.iter().for_each(|name| file.output(name, &[1, 2]));
        file.bytes()
    };
    let bytes =
        with_outputs(["mean", "value"], "mean := Identity(gemm(obs, 2, 11))\nvalue := Identity(gemm(obs, 2, 11))");
    refused(&bytes, "mean (2 values), value (2 values); choose one by actq import --output NAME");
    let choice = Choice { output: Some("value".to_owned()), ..Choice::default() };
    assert_eq!(imported(&bytes, &choice)?.0.cut_outputs, ["mean"]);
    // A value beside an output that cannot be imported need not be the action.
    let text = "x = gemm(obs, 2, 11)\ny = gemm(obs, 2, 11)\npolicy := Softmax(x)\nvalue := Identity(y)";
    let expected = "\"policy\" cannot be imported, and no other output is named action; choose one by actq import --output NAME: value (2 values): node 2";
    refused(&with_outputs(["policy", "value"], text), expected);
    Ok(())
}

#[test]
fn a_critic_never_replaces_a_drawn_action() -> Result<()> {
    let text = "mu = gemm(obs, 3, 11)
         v = gemm(obs, 1, 11)
         actions := Identity(mu + RandomNormal(shape=[1, 3]))
         log_prob := ReduceSum(mu * RandomNormal(shape=[1, 3]), keepdims=0)
         value := Identity(v)
         std := Identity([0.5, 0.5, 0.5])
         mean := Identity(mu)";
    let with_outputs = |names: &[&str]| {
        let mut file = begun();
        file.write(&[], text);
        names.iter().for_each(|name| file.output(name, &[1, if *name == "value" { 1 } else { 3 }]));
        file.bytes()
    };
    for names in [
        ["actions", "value", "log_prob"],
        ["value", "actions", "log_prob"],
        ["log_prob", "value", "actions"],
        ["value", "log_prob", "std"],
        ["std", "log_prob", "value"],
    ] {
        refused(&with_outputs(&names), "choose one by actq import --output NAME: value (1 values)");
    }
    for names in [["log_prob", "value", "mean"], ["mean", "actions", "value"], ["std", "value", "mean"]] {
        let bytes = with_outputs(&names);
        refused(&bytes, "value (1 values)");
        refused(&bytes, "mean (3 values)");
        let choice = Choice { output: Some("mean".to_owned()), ..Choice::default() };
        assert_eq!(imported(&bytes, &choice)?.0.output, ("mean".to_owned(), 3));
    }
    Ok(())
}

#[test]
fn a_critic_never_replaces_a_constant_action() {
    let mut file = begun();
    file.write(&[], "action := Identity([0.5, 0.5])\nvalue := Identity(gemm(obs, 1, 11))");
    file.output("action", &[1, 2]);
    file.output("value", &[1, 1]);
    refused(&file.bytes(), "\"action\" cannot be imported, and no other output is named action");
}

#[test]
fn a_refused_action_is_not_replaced_by_states() {
    let mut file = begun();
    for (state, next) in [("h", "h_out"), ("k", "k_out")] {
        file.input(state, &[1, 1, 4]);
        file.output(next, &[1, 1, 4]);
    }
    file.write(
        &[],
        "x = Unsqueeze(obs, [0])
         , h_out := GRU(x, drawn(1, 12, 11), drawn(1, 12, 4), drawn(1, 24), , h, hidden_size=4, linear_before_reset=1)
         , k_out := GRU(h_out, drawn(1, 12, 4), drawn(1, 12, 4), drawn(1, 24), , k, hidden_size=4, linear_before_reset=1)
         action := Softsign(gemm(Squeeze(k_out, [0]), 3, 4))",
    );
    file.output("action", &[1, 3]);
    let error = format!("{:#}", imported(&file.bytes(), &Choice::default()).expect_err("Softsign"));
    let expected = "output \"action\" cannot be imported, and all other outputs are states: node 5";
    assert!(error.contains(expected) && !error.contains("_out"), "{error}");
}
