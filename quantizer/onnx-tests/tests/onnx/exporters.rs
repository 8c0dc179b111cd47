//! Forms found in the output of PyTorch's exporters and tf2onnx (docs/records/2026-11-22-exporters.md), against tract.

use actq::measure::actions::actions;
use actq_onnx::{Choice, proto};
use anyhow::{Context as _, Result};
use prost::Message as _;

use super::file::{File, Value, encoded};
use super::styles::{OBS, begun, ended, ops};
use super::{compare, drawn, imported, same};

/// A step of a network whose value has 16 elements.
type Step = fn(&mut File, &str) -> String;

/// Returns the ops between two layers; compares each form with tract.
fn between(steps: &[(&str, Step)]) -> Result<()> {
    for (i, (expected, step)) in steps.iter().enumerate() {
        let mut file = begun();
        let x = file.gemm("obs", 16, OBS);
        let x = step(&mut file, &x);
        let found = ops(&ended(file, &x, 16)).with_context(|| format!("{i} {expected}"))?;
        assert_eq!(found, format!("linear {expected} linear"), "{i}");
    }
    Ok(())
}

fn refused(bytes: &[u8], expected: &str) {
    let error = format!("{:#}", imported(bytes, &Choice::default()).expect_err(expected));
    assert!(error.contains(expected), "{error} instead of {expected}");
}

#[test]
fn layers_of_constants_are_folded() -> Result<()> {
    // The time of a denoising step that the exporter wrote as a constant, with its embedding and layers.
    let mut file = begun();
    let time = file.drawn(&[1, 4]);
    let x = file.gemm(&time, 8, 4);
    let erf = file.node("Erf", &[&x], &[]);
    let x = file.node("Mul", &[&x, &erf], &[]);
    let x = ["Elu", "Softplus", "LeakyRelu", "Tanh", "HardSigmoid"].iter().fold(x, |x, op| file.node(op, &[&x], &[]));
    let w = file.drawn(&[8]);
    let x = file.node("LayerNormalization", &[&x, &w, &w], &[("axis", Value::Int(-1))]);
    let x = file.node("LpNormalization", &[&x], &[("axis", Value::Int(-1)), ("p", Value::Int(2))]);
    // Beside the observation, through one function.
    let x = file.node("Concat", &["obs", &x], &[("axis", Value::Int(1))]);
    let x = file.node("Elu", &[&x], &[]);
    assert_eq!(ops(&ended(file, &x, OBS + 8))?, "elu linear");
    // A choice by a comparison of real constants.
    let mut file = begun();
    let (mask, zero) = (file.drawn(&[1, OBS]), file.reals(&[], &[0.0]));
    let above = file.node("Greater", &[&mask, &zero], &[]);
    let x = file.node("Where", &[&above, "obs", &mask], &[]);
    assert_eq!(ops(&ended(file, &x, OBS))?, "linear");
    Ok(())
}

#[test]
fn sums_and_means_are_products_with_ones() -> Result<()> {
    fn mean(file: &mut File, x: &str) -> String {
        file.node("ReduceMean", &[x], &[("axes", Value::Ints(vec![-1])), ("keepdims", Value::Int(1))])
    }
    between(&[("linear identity add", |file, x| {
        let mean = mean(file, x);
        file.node("Sub", &[x, &mean], &[])
    })])?;
    // Sums of equal length share their row of ones.
    let mut file = begun();
    let (x, axes) = (file.gemm("obs", 16, OBS), file.ints(&[-1]));
    let sums = ["Tanh", "Sin"].map(|op| {
        let y = file.node(op, &[&x], &[]);
        file.node("ReduceSum", &[&y, &axes], &[("keepdims", Value::Int(1))])
    });
    let sums = sums.each_ref().map(String::as_str);
    let both = file.node("Concat", &sums, &[("axis", Value::Int(1))]);
    let both = file.node("Tanh", &[&both], &[]);
    let json = String::from_utf8(same(&ended(file, &both, 2))?.json)?;
    assert!(json.contains("sum.weight") && !json.contains("sum.weight.2"), "{json}");
    // The mean of an ensemble takes whole vectors.
    let mut file = begun();
    let members = [0; 3].map(|_| {
        let y = file.gemm("obs", 5, OBS);
        let y = file.node("Tanh", &[&y], &[]);
        let axes = file.ints(&[0]);
        file.node("Unsqueeze", &[&y, &axes], &[])
    });
    let members = members.each_ref().map(String::as_str);
    let all = file.node("Concat", &members, &[("axis", Value::Int(0))]);
    let x = file.node("ReduceMean", &[&all], &[("axes", Value::Ints(vec![0])), ("keepdims", Value::Int(0))]);
    let found = ops(&ended(file, &x, 5))?;
    assert_eq!(found.matches("add").count(), 2, "{found}");
    assert_eq!(found.matches("linear").count(), 4, "{found}");
    Ok(())
}

#[test]
fn powers_logarithms_and_lengths_are_found() -> Result<()> {
    between(&[
        ("exp", |file, x| {
            let two = file.reals(&[], &[2.0]);
            file.node("Pow", &[&two, x], &[])
        }),
        ("mul mul", |file, x| {
            let four = file.reals(&[], &[4.0]);
            file.node("Pow", &[x, &four], &[])
        }),
        // A LeakyReLU after a norm, with a slope.
        ("layernorm relu normalize add", |file, x| {
            let (w, b) = (file.drawn(&[16]), file.drawn(&[16]));
            let x = file.node("LayerNormalization", &[x, &w, &b], &[("axis", Value::Int(-1))]);
            let (zero, slope) = (file.reals(&[], &[0.0]), file.reals(&[], &[0.1]));
            let above = file.node("Greater", &[&x, &zero], &[]);
            let below = file.node("Mul", &[&slope, &x], &[]);
            file.node("Where", &[&above, &x, &below], &[])
        }),
        // LogSigmoid
        ("softplus", |file, x| {
            let s = file.node("Sigmoid", &[x], &[]);
            file.node("Log", &[&s], &[])
        }),
        // x / (|x| + 1e-8)
        ("rmsnorm", |file, x| {
            let length = file.node("ReduceL2", &[x], &[("axes", Value::Ints(vec![1])), ("keepdims", Value::Int(1))]);
            let least = file.reals(&[], &[1e-8]);
            let length = file.node("Add", &[&length, &least], &[]);
            file.node("Div", &[x, &length], &[])
        }),
    ])
}

#[test]
fn elements_are_taken_replaced_and_padded() -> Result<()> {
    let mut file = begun();
    let [pads, indices, places] = [vec![0, 1, 0, 2], vec![3, 1, 1], vec![2, 0]].map(|v| file.ints(&v));
    let (fill, new, one) = (file.reals(&[], &[0.7]), file.drawn(&[1, 2]), file.ints(&[1, -1]));
    let padded = file.node("Pad", &["obs", &pads, &fill], &[]);
    let row = |file: &mut File, list: &str| file.node("Reshape", &[list, &one], &[]);
    let (indices, places) = (row(&mut file, &indices), row(&mut file, &places));
    let taken = file.node("GatherElements", &["obs", &indices], &[("axis", Value::Int(1))]);
    let replaced = file.node("ScatterElements", &["obs", &places, &new], &[("axis", Value::Int(1))]);
    let x = file.node("Concat", &[&padded, &taken, &replaced], &[("axis", Value::Int(1))]);
    assert_eq!(ops(&ended(file, &x, OBS + 3 + 3 + OBS))?, "linear");
    Ok(())
}

#[test]
fn convolutions_over_few_positions_are_products() -> Result<()> {
    let ints = |name, values: &[i64]| (name, Value::Ints(values.to_vec()));
    // Kernel, shape of the value, attributes, values after it.
    let cases = [
        (vec![6, 8, 1], vec![1, 8, 4], vec![], 24),
        (vec![6, 8, 3], vec![1, 8, 4], vec![ints("pads", &[1, 1]), ints("strides", &[2])], 12),
        (vec![6, 2, 2], vec![1, 4, 8], vec![("group", Value::Int(2)), ints("dilations", &[3])], 30),
        (vec![6, 8, 2], vec![1, 8, 4], vec![("auto_pad", Value::Text("SAME_UPPER"))], 24),
        (vec![3, 2, 2, 3], vec![1, 2, 4, 4], vec![], 18),
    ];
    for (i, (kernel, shape, attributes, behind)) in cases.into_iter().enumerate() {
        let mut file = begun();
        let x = file.gemm("obs", 32, OBS);
        let shape = file.ints(&shape);
        let x = file.node("Reshape", &[&x, &shape], &[]);
        let (w, b) = (file.drawn(&kernel), file.drawn(&[kernel[0]]));
        let x = file.node("Conv", &[&x, &w, &b], &attributes);
        let x = file.node("Flatten", &[&x], &[]);
        let x = file.node("Relu", &[&x], &[]);
        same(&ended(file, &x, behind)).with_context(|| i.to_string())?;
    }
    let mut file = File::default();
    file.input("image", &[1, 3, 16, 16]);
    let w = file.drawn(&[4, 3, 3, 3]);
    let x = file.node("Conv", &["image", &w], &[]);
    let x = file.node("Flatten", &[&x], &[]);
    refused(
        &ended(file, &x, 784),
        "(Conv): has 196 positions with 1 groups; the limit of positions times groups is 64",
    );
    let mut file = File::default();
    file.input("history", &[1, 8, 10]);
    let w = file.drawn(&[8, 1, 1]);
    let x = file.node("Conv", &["history", &w], &[("group", Value::Int(8))]);
    let x = file.node("Flatten", &[&x], &[]);
    refused(&ended(file, &x, 80), "has 10 positions with 8 groups; the limit of positions times groups is 64");
    Ok(())
}

#[test]
fn transposed_values_are_computed_in_order() -> Result<()> {
    let mut file = begun();
    let x = file.gemm("obs", 16, OBS);
    let (apart, joined) = (file.ints(&[1, 4, 4]), file.ints(&[1, 16]));
    let x = file.node("Reshape", &[&x, &apart], &[]);
    let x = file.node("Transpose", &[&x], &[("perm", Value::Ints(vec![0, 2, 1]))]);
    let gate = file.node("Sigmoid", &[&x], &[]);
    let x = file.node("Mul", &[&x, &gate], &[]);
    let x = file.node("Transpose", &[&x], &[("perm", Value::Ints(vec![0, 2, 1]))]);
    let x = file.node("Reshape", &[&x, &joined], &[]);
    assert_eq!(ops(&ended(file, &x, 16))?, "linear silu linear");
    Ok(())
}

#[test]
fn einsums_with_constants_are_products() -> Result<()> {
    for (equation, w, rest) in [
        ("bi,oi->bo", vec![16, 16], None),
        ("bi,io->bo", vec![16, 16], None),
        ("btd,hdk->bhtk", vec![2, 4, 2], Some(4)),
    ] {
        let mut file = begun();
        let mut x = file.gemm("obs", 16, OBS);
        if let Some(steps) = rest {
            let shape = file.ints(&[1, steps, 4]);
            x = file.node("Reshape", &[&x, &shape], &[]);
        }
        let w = file.drawn(&w);
        let x = file.node("Einsum", &[&x, &w], &[("equation", Value::Text(equation))]);
        let x = file.node("Flatten", &[&x], &[]);
        let x = file.node("Tanh", &[&x], &[]);
        same(&ended(file, &x, 16)).with_context(|| equation.to_owned())?;
    }
    Ok(())
}

#[test]
fn norms_of_groups_are_norms_of_rows() -> Result<()> {
    // torch's GroupNorm: an instance norm of [1, group, ..], then a factor and an offset for each channel.
    let mut file = begun();
    let x = file.gemm("obs", 16, OBS);
    let (apart, joined) = (file.ints(&[1, 4, 4]), file.ints(&[1, 16]));
    let x = file.node("Reshape", &[&x, &apart], &[]);
    let (ones, zeros) = (file.reals(&[4], &[1.0; 4]), file.reals(&[4], &[0.0; 4]));
    let x = file.node("InstanceNormalization", &[&x, &ones, &zeros], &[("epsilon", Value::Real(1e-5))]);
    let x = file.node("Reshape", &[&x, &joined], &[]);
    let (w, b) = (file.drawn(&[16]), file.drawn(&[16]));
    let x = file.node("Mul", &[&x, &w], &[]);
    let x = file.node("Add", &[&x, &b], &[]);
    assert_eq!(same(&ended(file, &x, 16))?.ops.iter().filter(|op| *op == "layernorm").count(), 4);
    Ok(())
}

#[test]
fn function_overloads_are_distinguished() -> Result<()> {
    let function = |overload: &str, op: &str| {
        let node = proto::Node {
            op_type: Some(op.to_owned()),
            input: vec!["x".to_owned()],
            output: vec!["y".to_owned()],
            ..Default::default()
        };
        encoded(&proto::Function {
            name: Some("Act".to_owned()),
            domain: Some("local".to_owned()),
            overload: Some(overload.to_owned()),
            input: vec!["x".to_owned()],
            output: vec!["y".to_owned()],
            node: vec![encoded(&node)],
            ..Default::default()
        })
    };
    let network = |called: bool| {
        let mut file = begun();
        let mut x = file.gemm("obs", 16, OBS);
        for (overload, op) in [("first", "Tanh"), ("second", "Elu")] {
            x = if called { file.call(overload, &x) } else { file.node(op, &[&x], &[]) };
        }
        let y = file.gemm(&x, 3, 16);
        file.nodes("Identity", &[&y], &["actions"], &[]);
        file.output("actions", &[1, 3]);
        file.model()
    };
    let plain = network(false).encode_to_vec();
    let functions = vec![function("first", "Tanh"), function("second", "Elu")];
    let called = proto::Model { functions, ..network(true) }.encode_to_vec();
    let [ours, theirs] = [called, plain].map(|bytes| imported(&bytes, &Choice::default()));
    let (ours, theirs) = (ours?.1, theirs?.1);
    let observations = drawn(&ours);
    compare(&actions(&theirs, &observations), &actions(&ours, &observations))
}

#[test]
fn ambiguous_files_are_refused() -> Result<()> {
    let mut file = begun();
    let x = file.node("Tanh", &["obs"], &[]);
    let x = file.gemm(&x, 3, OBS);
    file.nodes("Identity", &[&x], &["actions"], &[]);
    file.output("actions", &[1, 3]);
    same(&file.bytes())?;
    let with_opset = |version: Option<i64>| {
        let set = |version| encoded(&proto::OperatorSet { domain: None, version: Some(version) });
        proto::Model { opset_import: version.map(set).into_iter().collect(), ..file.model() }.encode_to_vec()
    };
    refused(&with_opset(None), "does not give the version of its ONNX operators");
    refused(&with_opset(Some(6)), "export it with opset 7 or above");
    // A batch, not a chunk of actions.
    let mut file = File::default();
    file.input("obs", &[4, OBS as i64]);
    let y = file.gemm("obs", 3, OBS);
    file.nodes("Tanh", &[&y], &["actions"], &[]);
    file.output("actions", &[4, 3]);
    refused(&file.bytes(), "have 4 rows, which is a batch");
    // A batch beside an input of one row.
    let mut file = File::default();
    file.input("command", &[1, 2]);
    file.input("obs", &[4, OBS as i64]);
    let (x, y) = (file.gemm("command", 3, 2), file.gemm("obs", 3, OBS));
    file.nodes("Add", &[&x, &y], &["actions"], &[]);
    file.output("actions", &[4, 3]);
    refused(&file.bytes(), "the action and the input \"obs\" have 4 rows, which is a batch");
    // A vector with as many values as the chunk has actions is no batch.
    let mut file = File::default();
    file.input("x", &[4]);
    let (w, shape) = (file.drawn(&[4, 12]), file.ints(&[4, 3]));
    let y = file.node("MatMul", &["x", &w], &[]);
    file.nodes("Reshape", &[&y, &shape], &["actions"], &[]);
    file.output("actions", &[4, 3]);
    assert_eq!(imported(&file.bytes(), &Choice::default())?.0.output.1, 12);
    Ok(())
}

#[test]
fn limits_far_from_zero_lose_no_digits() -> Result<()> {
    // A million is far beyond the output of a layer, about 1: subtracting and adding it would lose 0.06.
    fn clipped(file: &mut File, x: &str, low: &str, high: &str) -> String {
        let limits = [low, high].map(|limit| match limit {
            "" => String::new(),
            limit => file.reals(&[], &[limit.parse().expect("a number")]),
        });
        file.node("Clip", &[x, &limits[0], &limits[1]], &[])
    }
    between(&[
        ("normalize normalize relu add", |file, x| clipped(file, x, "-1e6", "")),
        ("normalize normalize relu normalize add", |file, x| clipped(file, x, "", "1e6")),
        ("relu normalize", |file, x| clipped(file, x, "0", "1e6")),
        // One clip has two limits in sequence.
        ("normalize", |file, x| {
            let low = clipped(file, x, "-1e6", "");
            clipped(file, &low, "", "1e6")
        }),
        ("relu normalize", |file, x| {
            let positive = file.node("Relu", &[x], &[]);
            clipped(file, &positive, "", "6")
        }),
        ("normalize", |file, x| {
            let (high, low) = (file.reals(&[], &[0.3]), file.reals(&[], &[-0.3]));
            let [above, below] =
                [("Greater", &high), ("Less", &low)].map(|(op, limit)| file.node(op, &[x, limit], &[]));
            let x = file.node("Where", &[&below, &low, x], &[]);
            file.node("Where", &[&above, &high, &x], &[])
        }),
    ])?;
    // A limit for each value, on either side of zero, or none.
    let limits: Vec<f32> =
        (0..16).map(|i| [-1e6, -0.2, 0.0, 0.1, 5.0, -40.0, -3e4, f32::NEG_INFINITY][i % 8]).collect();
    for (op, sign) in [("Max", 1.0), ("Min", -1.0)] {
        let mut file = begun();
        let x = file.gemm("obs", 16, OBS);
        let limits: Vec<f32> = limits.iter().map(|limit| sign * limit).collect();
        let limits = file.reals(&[16], &limits);
        let x = file.node(op, &[&x, &limits], &[]);
        same(&ended(file, &x, 16)).with_context(|| op.to_owned())?;
    }
    Ok(())
}

#[test]
fn network_values_count_as_finite() -> Result<()> {
    fn zero(file: &mut File) -> String {
        file.reals(&[], &[0.0])
    }
    between(&[
        // nan_to_num
        ("relu", |file, x| {
            let (zero, large) = (zero(file), file.reals(&[], &[3e38]));
            let (nan, infinite) = (file.node("IsNaN", &[x], &[]), file.node("IsInf", &[x], &[]));
            let y = file.node("Where", &[&nan, &zero, x], &[]);
            let y = file.node("Where", &[&infinite, &large, &y], &[]);
            file.node("Relu", &[&y], &[])
        }),
        // The same by torch's exporter: infinite, and above 0.
        ("relu", |file, x| {
            let (zero, large) = (zero(file), file.reals(&[], &[3e38]));
            let infinite = file.node("IsInf", &[x], &[]);
            let above = file.node("Greater", &[x, &zero], &[]);
            let above = file.node("Cast", &[&above], &[("to", Value::Int(9))]);
            let both = file.node("And", &[&infinite, &above], &[]);
            let y = file.node("Where", &[&both, &large, x], &[]);
            file.node("Relu", &[&y], &[])
        }),
        // jax.numpy.logaddexp(x, 0)
        ("softplus", |file, x| {
            let (zero, one) = (zero(file), file.reals(&[], &[1.0]));
            let same = file.node("Equal", &[x, x], &[]);
            let nan = file.node("Not", &[&same], &[]);
            let (more, size) = (file.node("Max", &[x, &zero], &[]), file.node("Abs", &[x], &[]));
            let e = file.node("Neg", &[&size], &[]);
            let e = file.node("Exp", &[&e], &[]);
            let e = file.node("Add", &[&e, &one], &[]);
            let e = file.node("Log", &[&e], &[]);
            let y = file.node("Add", &[&more, &e], &[]);
            file.node("Where", &[&nan, x, &y], &[])
        }),
    ])
}

#[test]
fn max_min_and_mean_over_positions_are_found() -> Result<()> {
    // A set of points, each through one layer; only their pooled values remain.
    for op in ["ReduceMax", "ReduceMin", "GlobalMaxPool", "GlobalAveragePool", "ReduceL1"] {
        let mut file = File::default();
        file.input("points", &[1, 5, 3]);
        let w = file.drawn(&[3, 8]);
        let x = file.node("MatMul", &["points", &w], &[]);
        let x = file.node("Transpose", &[&x], &[("perm", Value::Ints(vec![0, 2, 1]))]);
        let axes = [("axes", Value::Ints(vec![2])), ("keepdims", Value::Int(1))];
        let x = file.node(op, &[&x], if op.starts_with("Reduce") { &axes } else { &[] });
        let x = file.node("Flatten", &[&x], &[]);
        same(&ended(file, &x, 8)).with_context(|| op.to_owned())?;
    }
    let mut file = File::default();
    file.input("points", &[1, 65, 1]);
    let x = file.node("ReduceMax", &["points"], &[("axes", Value::Ints(vec![1])), ("keepdims", Value::Int(0))]);
    refused(&ended(file, &x, 1), "(ReduceMax): takes the maximum or minimum of 65 values; the limit is 64");
    Ok(())
}

#[test]
fn batched_matrices_become_several_products() -> Result<()> {
    // An ensemble of three, as from torch.bmm.
    let mut file = begun();
    let (w, b, v) = (file.drawn(&[3, OBS, 8]), file.drawn(&[3, 1, 8]), file.drawn(&[3, 8, 5]));
    let x = file.node("MatMul", &["obs", &w], &[]);
    let x = file.node("Add", &[&x, &b], &[]);
    let x = file.node("Tanh", &[&x], &[]);
    let x = file.node("MatMul", &[&x, &v], &[]);
    let x = file.node("ReduceMean", &[&x], &[("axes", Value::Ints(vec![0])), ("keepdims", Value::Int(0))]);
    let found = ops(&ended(file, &x, 5))?;
    assert_eq!(found.matches("linear").count(), 7, "{found}");
    Ok(())
}

#[test]
fn norms_accept_constants_beside_values() -> Result<()> {
    // SimbaV2: an L2 norm of the observation and a constant.
    let mut file = begun();
    let shift = file.reals(&[1, 1], &[3.0]);
    let x = file.node("Concat", &["obs", &shift], &[("axis", Value::Int(1))]);
    let length = file.node("ReduceL2", &[&x], &[("axes", Value::Ints(vec![1])), ("keepdims", Value::Int(1))]);
    let x = file.node("Div", &[&x, &length], &[]);
    assert_eq!(ops(&ended(file, &x, OBS + 1))?, "linear rmsnorm linear");
    Ok(())
}

#[test]
fn one_value_joins_with_many() -> Result<()> {
    // The time of a denoising step, and its 150 frequencies.
    let mut file = File::default();
    file.input("time", &[1, 1]);
    let frequencies = file.drawn(&[1, 150]);
    let x = file.node("Mul", &["time", &frequencies], &[]);
    let [sin, cos] = ["Sin", "Cos"].map(|op| file.node(op, &[&x], &[]));
    let x = file.node("Concat", &[&sin, &cos], &[("axis", Value::Int(1))]);
    assert_eq!(ops(&ended(file, &x, 300))?, "identity normalize sin cos linear");
    Ok(())
}

#[test]
fn choices_that_resemble_an_activation_are_refused() -> Result<()> {
    let softplus = |compare: &str, linear_first: bool| {
        let mut file = begun();
        let (x, limit) = (file.gemm("obs", 16, OBS), file.reals(&[], &[20.0]));
        let s = file.node("Softplus", &[&x], &[]);
        let c = file.node(compare, &[&x, &limit], &[]);
        let (a, b) = if linear_first { (&x, &s) } else { (&s, &x) };
        let y = file.node("Where", &[&c, a, b], &[]);
        ended(file, &y, 16)
    };
    assert_eq!(ops(&softplus("Greater", true))?, "linear softplus linear");
    assert_eq!(ops(&softplus("Less", false))?, "linear softplus linear");
    // The linear part below the limit.
    for (compare, linear_first) in [("Less", true), ("Greater", false)] {
        refused(&softplus(compare, linear_first), "chooses by a value of the network and does not form an activation");
    }
    // A limit that repeats the value: [1, 5] and [5, 1] give [5, 5].
    let mut file = begun();
    let (x, limit) = (file.gemm("obs", 5, OBS), file.reals(&[5, 1], &[0.0; 5]));
    let c = file.node("Greater", &[&x, &limit], &[]);
    let zero = file.reals(&[], &[0.0]);
    let y = file.node("Where", &[&c, &x, &zero], &[]);
    refused(&ended(file, &y, 5), "(Greater): compares the observation");
    Ok(())
}

#[test]
fn the_same_file_gives_the_same_bytes() -> Result<()> {
    let mut file = File::default();
    file.input("b", &[1, 4]);
    file.input("a", &[1, 4]);
    // Elements of both in turn, which are computed in the order of their values.
    let joined = file.node("Concat", &["a", "b"], &[("axis", Value::Int(0))]);
    let turned = file.node("Transpose", &[&joined], &[("perm", Value::Ints(vec![1, 0]))]);
    let shape = file.ints(&[1, 8]);
    let x = file.node("Reshape", &[&turned, &shape], &[]);
    let x = file.node("Tanh", &[&x], &[]);
    let bytes = ended(file, &x, 8);
    let first = same(&bytes)?;
    for _ in 0..8 {
        let again = imported(&bytes, &Choice::default())?.0;
        assert_eq!((&again.json, &again.weights), (&first.json, &first.weights));
    }
    Ok(())
}
