//! Each style in which exporters write a policy, against tract.

use actq::data::{Recording, Sizes};
use actq_bench::shared_policies;
use actq_onnx::{Choice, Onnx};
use anyhow::{Context as _, Result, ensure};
use proptest::prelude::*;

use super::file::{File, Value, encoded, tensor};
use super::{by_tract, compare, drawn, imported, same};
use actq::import::Importer as _;
use actq::measure::actions::actions;
use actq::policy::Policy;
use actq_onnx::import;

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

pub(super) fn ops(bytes: &[u8]) -> Result<String> {
    Ok(same(bytes)?.ops.join(" "))
}

#[test]
fn normalizers_and_layers_become_native_operations() -> Result<()> {
    // rsl_rl: Sub, Div, Gemm, Elu.
    let mut file = begun();
    let (mean, std) = (file.drawn(&[1, OBS]), file.reals(&[1, OBS], &[1.5; OBS]));
    let x = file.node("Sub", &["obs", &mean], &[]);
    let x = file.node("Div", &[&x, &std], &[]);
    let x = file.gemm(&x, 16, OBS);
    let x = file.node("Elu", &[&x], &[("alpha", Value::Real(1.0))]);
    assert_eq!(ops(&ended(file, &x, 16))?, "normalize linear elu linear");
    // Brax: weights [in, out], the bias on the left, SiLU in its parts, half of the last layer unused, tanh.
    let mut file = begun();
    let (w, b) = (file.drawn(&[OBS, 16]), file.drawn(&[16]));
    let x = file.node("MatMul", &["obs", &w], &[]);
    let x = file.node("Add", &[&b, &x], &[]);
    let gate = file.node("Sigmoid", &[&x], &[]);
    let x = file.node("Mul", &[&gate, &x], &[]);
    let x = file.gemm(&x, 8, 16);
    let parts = file.ints(&[4, 4]);
    file.nodes("Split", &[&x, &parts], &["loc", "scale"], &[("axis", Value::Int(1))]);
    file.nodes("Tanh", &["loc"], &["actions"], &[]);
    file.output("actions", &[1, 4]);
    assert_eq!(ops(&file.bytes())?, "linear silu linear tanh");
    Ok(())
}

#[test]
fn final_factors_and_limits_become_the_contract() -> Result<()> {
    // Stable-Baselines3: flatten, tanh, clip; then to the robot's range.
    let mut file = begun();
    let x = file.node("Flatten", &["obs"], &[]);
    let x = file.gemm(&x, 3, OBS);
    let x = file.node("Tanh", &[&x], &[]);
    let [low, high, two, half] = [-0.5, 0.5, 2.0, 0.5].map(|v| file.reals(&[], &[v]));
    let x = file.node("Clip", &[&x, &low, &high], &[]);
    let x = file.node("Mul", &[&x, &two], &[]);
    file.nodes("Add", &[&x, &half], &["actions"], &[]);
    file.output("actions", &[1, 3]);
    let imported = same(&file.bytes())?;
    assert_eq!(imported.ops, ["linear", "tanh"]);
    assert_eq!(imported.contract, ["scale", "offset", "low", "high"]);
    // A joint that is held still.
    let mut file = begun();
    let (x, held) = (file.gemm("obs", 3, OBS), file.reals(&[1, 1], &[0.7]));
    file.nodes("Concat", &[&x, &held], &["actions"], &[("axis", Value::Int(1))]);
    file.output("actions", &[1, 4]);
    assert_eq!(same(&file.bytes())?.contract, ["scale", "offset"]);
    Ok(())
}

#[test]
fn every_activation_is_native_or_composed() -> Result<()> {
    let cases = [
        ("Relu", "relu"),
        ("Elu", "elu"),
        ("Tanh", "tanh"),
        ("Sigmoid", "sigmoid"),
        ("Softplus", "softplus"),
        ("LeakyRelu", "relu normalize add"),
        ("Selu", "elu relu normalize add"),
        ("HardSwish", "normalize normalize mul"),
        ("Exp", "exp"),
        ("Sin", "sin"),
        ("Cos", "cos"),
        ("Abs", "relu normalize relu add"),
    ];
    for (op, expected) in cases {
        let mut file = begun();
        let x = file.gemm("obs", 16, OBS);
        let x = file.node(op, &[&x], &[]);
        let found = ops(&ended(file, &x, 16)).with_context(|| op.to_owned())?;
        assert_eq!(found, format!("linear {expected} linear"), "{op}");
    }
    Ok(())
}

/// The nodes of a function of a value.
type Written = fn(&mut File, &str) -> String;

/// The ops of each, and the nodes that exporters make of it.
pub(super) const ACTIVATIONS: [(&str, Written); 10] = [
    // jax.nn.gelu: 1 - erf(-x / sqrt 2)
    ("gelu", |file, x| {
        let [root, one, half] = [0.5f32.sqrt(), 1.0, 0.5].map(|v| file.reals(&[], &[v]));
        let e = file.node("Neg", &[x], &[]);
        let e = file.node("Mul", &[&e, &root], &[]);
        let e = file.node("Erf", &[&e], &[]);
        let e = file.node("Sub", &[&one, &e], &[]);
        let y = file.node("Mul", &[x, &e], &[]);
        file.node("Mul", &[&half, &y], &[])
    }),
    ("gelu", |file, x| {
        let [root, one, half] = [2f32.sqrt(), 1.0, 0.5].map(|v| file.reals(&[], &[v]));
        let e = file.node("Div", &[x, &root], &[]);
        let e = file.node("Erf", &[&e], &[]);
        let e = file.node("Add", &[&e, &one], &[]);
        let y = file.node("Mul", &[x, &e], &[]);
        file.node("Mul", &[&y, &half], &[])
    }),
    ("gelu_tanh", |file, x| {
        let [three, small, root, one, half] = [3.0, 0.044_715, 0.797_884_6, 1.0, 0.5].map(|v| file.reals(&[], &[v]));
        let cube = file.node("Pow", &[x, &three], &[]);
        let cube = file.node("Mul", &[&cube, &small], &[]);
        let sum = file.node("Add", &[x, &cube], &[]);
        let sum = file.node("Mul", &[&sum, &root], &[]);
        let t = file.node("Tanh", &[&sum], &[]);
        let t = file.node("Add", &[&one, &t], &[]);
        let h = file.node("Mul", &[x, &half], &[]);
        file.node("Mul", &[&h, &t], &[])
    }),
    // TensorFlow: half of x first.
    ("gelu", |file, x| {
        let [root, one, half] = [2f32.sqrt(), 1.0, 0.5].map(|v| file.reals(&[], &[v]));
        let e = file.node("Div", &[x, &root], &[]);
        let e = file.node("Erf", &[&e], &[]);
        let e = file.node("Add", &[&e, &one], &[]);
        let h = file.node("Mul", &[&half, x], &[]);
        file.node("Mul", &[&h, &e], &[])
    }),
    ("gelu", |file, x| {
        let [root, half] = [2f32.sqrt(), 0.5].map(|v| file.reals(&[], &[v]));
        let e = file.node("Div", &[x, &root], &[]);
        let e = file.node("Erf", &[&e], &[]);
        let e = file.node("Mul", &[&e, &half], &[]);
        let e = file.node("Add", &[&half, &e], &[]);
        file.node("Mul", &[x, &e], &[])
    }),
    // Beside the residual that reads the same value.
    ("gelu add", |file, x| {
        let [root, one, half] = [2f32.sqrt(), 1.0, 0.5].map(|v| file.reals(&[], &[v]));
        let e = file.node("Div", &[x, &root], &[]);
        let e = file.node("Erf", &[&e], &[]);
        let e = file.node("Add", &[&e, &one], &[]);
        let h = file.node("Mul", &[x, &half], &[]);
        let y = file.node("Mul", &[&h, &e], &[]);
        file.node("Add", &[&y, x], &[])
    }),
    ("mish", |file, x| {
        let s = file.node("Softplus", &[x], &[]);
        let t = file.node("Tanh", &[&s], &[]);
        file.node("Mul", &[x, &t], &[])
    }),
    ("silu", |file, x| {
        let one = file.reals(&[], &[1.0]);
        let e = file.node("Neg", &[x], &[]);
        let e = file.node("Exp", &[&e], &[]);
        let e = file.node("Add", &[&e, &one], &[]);
        file.node("Div", &[x, &e], &[])
    }),
    ("softplus", |file, x| {
        let one = file.reals(&[], &[1.0]);
        let e = file.node("Exp", &[x], &[]);
        let e = file.node("Add", &[&e, &one], &[]);
        file.node("Log", &[&e], &[])
    }),
    ("elu", |file, x| {
        let [one, zero] = [1.0, 0.0].map(|v| file.reals(&[], &[v]));
        let e = file.node("Exp", &[x], &[]);
        let e = file.node("Sub", &[&e, &one], &[]);
        let above = file.node("Greater", &[x, &zero], &[]);
        file.node("Where", &[&above, x, &e], &[])
    }),
];

#[test]
fn activations_in_their_parts_are_found() -> Result<()> {
    for (name, written) in ACTIVATIONS {
        let mut file = begun();
        let x = file.gemm("obs", 16, OBS);
        let x = written(&mut file, &x);
        let found = ops(&ended(file, &x, 16)).with_context(|| name.to_owned())?;
        assert_eq!(found, format!("linear {name} linear"));
    }
    Ok(())
}

/// `x W + h U + b` of a cell in its parts, sliced into gates.
fn gates(file: &mut File, h: &str, names: &[&str], hidden: usize) {
    let (x, h) = (file.gemm("obs", names.len() * hidden, OBS), file.gemm(h, names.len() * hidden, hidden));
    let sum = file.node("Add", &[&x, &h], &[]);
    file.nodes("Split", &[&sum], names, &[("axis", Value::Int(1))]);
}

#[test]
fn recurrent_cells_carry_their_states() -> Result<()> {
    const H: usize = 8;
    for op in ["LSTM", "GRU"] {
        let mut file = begun();
        let gates = if op == "LSTM" { 4 } else { 3 };
        let axes = file.ints(&[0]);
        let x = file.node("Unsqueeze", &["obs", &axes], &[]);
        let (w, r, b) =
            (file.drawn(&[1, gates * H, OBS]), file.drawn(&[1, gates * H, H]), file.drawn(&[1, 2 * gates * H]));
        let states: &[&str] = if op == "LSTM" { &["h_in", "c_in"] } else { &["h_in"] };
        let nexts: &[&str] = if op == "LSTM" { &["h_out", "c_out"] } else { &["h_out"] };
        let inputs = [&[x.as_str(), &w, &r, &b, ""], states].concat();
        let outputs = [&["y"], nexts].concat();
        let own = if op == "LSTM" { vec![] } else { vec![("linear_before_reset", Value::Int(1))] };
        file.nodes(op, &inputs, &outputs, &[&[("hidden_size", Value::Int(H as i64))], &own[..]].concat());
        for (state, next) in states.iter().zip(nexts) {
            file.input(state, &[1, 1, H as i64]);
            file.output(next, &[1, 1, H as i64]);
        }
        let shape = file.ints(&[1, H as i64]);
        let y = file.node("Reshape", &["y", &shape], &[]);
        let bytes = ended(file, &y, H);
        let imported = same(&bytes).with_context(|| op.to_owned())?;
        assert_eq!(imported.ops, [&op.to_lowercase(), "linear"]);
        assert_eq!(imported.states.len(), states.len());
        assert_eq!(imported.inputs, [("obs".to_owned(), OBS)]);
    }
    Ok(())
}

#[test]
fn cells_in_their_parts_are_found() -> Result<()> {
    const H: usize = 8;
    let mut file = begun();
    file.input("h_in", &[1, H as i64]);
    file.input("c_in", &[1, H as i64]);
    gates(&mut file, "h_in", &["i", "f", "g", "o"], H);
    let [i, f, o] = ["i", "f", "o"].map(|gate| file.node("Sigmoid", &[gate], &[]));
    let g = file.node("Tanh", &["g"], &[]);
    let (kept, new) = (file.node("Mul", &[&f, "c_in"], &[]), file.node("Mul", &[&i, &g], &[]));
    file.nodes("Add", &[&kept, &new], &["c_out"], &[]);
    let t = file.node("Tanh", &["c_out"], &[]);
    file.nodes("Mul", &[&o, &t], &["h_out"], &[]);
    file.output("h_out", &[1, H as i64]);
    file.output("c_out", &[1, H as i64]);
    assert_eq!(ops(&ended(file, "h_out", H))?, "lstm linear");

    let mut file = begun();
    file.input("h_in", &[1, H as i64]);
    gates(&mut file, "h_in", &["r", "z"], H);
    let [r, z] = ["r", "z"].map(|gate| file.node("Sigmoid", &[gate], &[]));
    let (x, h) = (file.gemm("obs", H, OBS), file.gemm("h_in", H, H));
    let gated = file.node("Mul", &[&r, &h], &[]);
    let n = file.node("Add", &[&x, &gated], &[]);
    let n = file.node("Tanh", &[&n], &[]);
    let one = file.reals(&[], &[1.0]);
    let rest = file.node("Sub", &[&one, &z], &[]);
    let (new, kept) = (file.node("Mul", &[&rest, &n], &[]), file.node("Mul", &[&z, "h_in"], &[]));
    file.nodes("Add", &[&new, &kept], &["h_out"], &[]);
    file.output("h_out", &[1, H as i64]);
    assert_eq!(ops(&ended(file, "h_out", H))?, "gru linear");
    Ok(())
}

#[test]
fn inputs_join_in_order_and_dead_nodes_vanish() -> Result<()> {
    let mut file = File::default();
    file.input("masks", &[1, 2]);
    file.input("obs_0", &[-1, 4]);
    file.input("obs_1", &[-1, 3]);
    // A batch size read from the input.
    let shape = file.node("Shape", &["obs_0"], &[]);
    let (zero, last) = (file.ints(&[0]), file.ints(&[4]));
    let batch = file.node("Gather", &[&shape, &zero], &[("axis", Value::Int(0))]);
    let shape = file.node("Concat", &[&batch, &last], &[("axis", Value::Int(0))]);
    let x = file.node("Reshape", &["obs_0", &shape], &[]);
    let x = file.node("Concat", &["obs_1", &x], &[("axis", Value::Int(1))]);
    let y = file.gemm(&x, 3, 7);
    let noise = file.node("RandomNormal", &[], &[("shape", Value::Ints(vec![1, 3]))]);
    let random = file.node("Add", &[&y, &noise], &[]);
    let one = file.reals(&[1], &[3.0]);
    for (output, value, dims) in [
        ("version_number", &one, vec![1]),
        ("continuous_actions", &random, vec![-1, 3]),
        ("deterministic_continuous_actions", &y, vec![-1, 3]),
    ] {
        file.nodes("Identity", &[value], &[output], &[]);
        file.output(output, &dims);
    }
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
    let (w, b) = (file.drawn(&[5, 3]), file.drawn(&[3]));
    let y = file.node("MatMul", &["x", &w], &[]);
    file.nodes("Add", &[&b, &y], &["y"], &[]);
    file.output("y", &[3]);
    same(&file.bytes())?;
    // A gate beside a value, and slices of the observation.
    let mut file = begun();
    let (a, b) = (file.gemm("obs", 6, OBS), file.gemm("obs", 6, OBS));
    let gate = file.node("Sigmoid", &[&b], &[]);
    let x = file.node("Mul", &[&a, &gate], &[]);
    let [from, to, axis] = [2, 9, 1].map(|i| file.ints(&[i]));
    let part = file.node("Slice", &["obs", &from, &to, &axis], &[]);
    let x = file.node("Concat", &[&part, &x], &[("axis", Value::Int(-1))]);
    assert!(ops(&ended(file, &x, 13))?.contains("mul"));
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
                4 => file.node("Tanh", &[&at], &[]),
                5 => file.node("Elu", &[&at], &[]),
                6 => file.node("Sin", &[&at], &[]),
                7 => { let w = file.drawn(&[len]); file.node("Mul", &[&at, &w], &[]) }
                8 => { let w = file.drawn(&[1, len]); file.node("Sub", &[&w, &at], &[]) }
                9 => { let [a, b] = [-0.6, 0.9].map(|v| file.reals(&[], &[v])); file.node("Clip", &[&at, &a, &b], &[]) }
                10 => { let s = file.node("Sigmoid", &[&at], &[]); file.node("Mul", &[&at, &s], &[]) }
                11 => {
                    let (w, b) = (file.drawn(&[len]), file.drawn(&[len]));
                    file.node("LayerNormalization", &[&at, &w, &b], &[("axis", Value::Int(-1)), ("epsilon", Value::Real(1e-2))])
                }
                12 => file.node("LeakyRelu", &[&at], &[("alpha", Value::Real(0.2))]),
                _ => match &before {
                    Some((other, n)) if *n == len => file.node(if keep { "Add" } else { "Mul" }, &[&at, other], &[]),
                    Some((other, n)) => {
                        let y = file.node("Concat", &[other, &at], &[("axis", Value::Int(1))]);
                        len += n;
                        y
                    }
                    None => file.node("Relu", &[&at], &[]),
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
    let mut file = begun();
    for name in ["mean", "value"] {
        let y = file.gemm("obs", 2, OBS);
        file.nodes("Identity", &[&y], &[name], &[]);
        file.output(name, &[1, 2]);
    }
    let bytes = file.bytes();
    let error = format!("{:#}", imported(&bytes, &Choice::default()).expect_err("two outputs"));
    ensure!(error.contains("mean (2 values), value (2 values); choose one by actq import --output NAME"), "{error}");
    let choice = Choice { output: Some("value".to_owned()), ..Choice::default() };
    assert_eq!(imported(&bytes, &choice)?.0.cut_outputs, ["mean"]);
    // A value beside an output that cannot be imported need not be the action.
    let mut file = begun();
    let [x, y] = [(); 2].map(|()| file.gemm("obs", 2, OBS));
    for (op, of, name) in [("Softmax", &x, "policy"), ("Identity", &y, "value")] {
        file.nodes(op, &[of], &[name], &[]);
        file.output(name, &[1, 2]);
    }
    let error = format!("{:#}", imported(&file.bytes(), &Choice::default()).expect_err("a value"));
    let expected = "\"policy\" cannot be imported, and no other output is named action; choose one by actq import --output NAME: value (2 values): node 2";
    ensure!(error.contains(expected), "{error}");
    Ok(())
}

#[test]
fn a_refused_action_is_not_replaced_by_states() {
    const H: usize = 4;
    let mut file = begun();
    let axes = file.ints(&[0]);
    let mut x = file.node("Unsqueeze", &["obs", &axes], &[]);
    for (state, next, len) in [("h", "h_out", OBS), ("k", "k_out", H)] {
        let [w, r, b] = [vec![1, 3 * H, len], vec![1, 3 * H, H], vec![1, 6 * H]].map(|dims| file.drawn(&dims));
        let own = [("hidden_size", Value::Int(H as i64)), ("linear_before_reset", Value::Int(1))];
        file.nodes("GRU", &[&x, &w, &r, &b, "", state], &["", next], &own);
        file.input(state, &[1, 1, H as i64]);
        file.output(next, &[1, 1, H as i64]);
        x = next.to_owned();
    }
    let y = file.node("Squeeze", &["k_out", &axes], &[]);
    let y = file.gemm(&y, 3, H);
    file.nodes("Softsign", &[&y], &["action"], &[]);
    file.output("action", &[1, 3]);
    let error = format!("{:#}", imported(&file.bytes(), &Choice::default()).expect_err("Softsign"));
    let expected = "output \"action\" cannot be imported, and all other outputs are states: node 5";
    assert!(error.contains(expected) && !error.contains("_out"), "{error}");
}
