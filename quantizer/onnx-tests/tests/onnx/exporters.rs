//! Forms found in the output of PyTorch's exporters and tf2onnx (docs/records/2026-11-22-exporters.md), against tract.

use actq::measure::actions::actions;
use actq_onnx::{Choice, proto};
use anyhow::{Context as _, Result};
use prost::Message as _;
use prost::bytes::Bytes;

use super::file::{File, Value, encoded};
use super::styles::{OBS, begun, between, ended, found, network, ops, whole};
use super::{compare, drawn, imported, refused, same};

/// Writes a network of one input of this shape, whose last value has `len` elements, and a last layer.
fn of_input(name: &str, dims: &[i64], text: &str, len: usize) -> Vec<u8> {
    let mut file = File::default();
    file.input(name, dims);
    let last = file.write(&[], text);
    ended(file, &last, len)
}

#[test]
fn layers_of_constants_are_folded() -> Result<()> {
    // The time of a denoising step that the exporter wrote as a constant, with its embedding and layers; then beside
    // the observation, through one function.
    let folded = "x = gemm(drawn(1, 4), 8, 4)
                  x = HardSigmoid(Tanh(LeakyRelu(Softplus(Elu(x * Erf(x))))))
                  w = drawn(8)
                  x = LpNormalization(LayerNormalization(x, w, w, axis=-1), axis=-1, p=2)
                  Elu(Concat(obs, x, axis=1))";
    assert_eq!(found(folded, OBS + 8)?, "elu linear");
    // A choice by a comparison of real constants.
    let chosen = "mask = drawn(1, 11)
                  Where(Greater(mask, 0.0), obs, mask)";
    assert_eq!(found(chosen, OBS)?, "linear");
    Ok(())
}

#[test]
fn sums_and_means_are_products_with_ones() -> Result<()> {
    between(&[("linear identity add", "x - ReduceMean(x, axes=[-1], keepdims=1)")])?;
    // Sums of equal length share their row of ones.
    let sums = "x = gemm(obs, 16, 11)
                tanh = ReduceSum(Tanh(x), [-1], keepdims=1)
                sin = ReduceSum(Sin(x), [-1], keepdims=1)
                Tanh(Concat(tanh, sin, axis=1))";
    let json = String::from_utf8(same(&network(sums, 2))?.json)?;
    assert!(json.contains("sum.weight") && !json.contains("sum.weight.2"), "{json}");
    // The mean of an ensemble takes whole vectors.
    let ensemble = "a = Unsqueeze(Tanh(gemm(obs, 5, 11)), [0])
                    b = Unsqueeze(Tanh(gemm(obs, 5, 11)), [0])
                    c = Unsqueeze(Tanh(gemm(obs, 5, 11)), [0])
                    ReduceMean(Concat(a, b, c, axis=0), axes=[0], keepdims=0)";
    let found = found(ensemble, 5)?;
    assert_eq!(found.matches("add").count(), 2, "{found}");
    assert_eq!(found.matches("linear").count(), 4, "{found}");
    Ok(())
}

#[test]
fn powers_logarithms_and_lengths_are_found() -> Result<()> {
    between(&[
        ("exp", "Pow(2.0, x)"),
        ("mul mul", "Pow(x, 4.0)"),
        // A LeakyReLU after a norm, with a slope.
        (
            "layernorm relu normalize add",
            "n = LayerNormalization(x, drawn(16), drawn(16), axis=-1)
             Where(Greater(n, 0.0), n, 0.1 * n)",
        ),
        // LogSigmoid
        ("softplus", "Log(Sigmoid(x))"),
        ("rmsnorm", "x / (ReduceL2(x, axes=[1], keepdims=1) + 1e-8)"),
    ])
}

#[test]
fn elements_are_taken_replaced_and_padded() -> Result<()> {
    let text = "padded = Pad(obs, [0, 1, 0, 2], 0.7)
                taken = GatherElements(obs, Reshape([3, 1, 1], [1, -1]), axis=1)
                replaced = ScatterElements(obs, Reshape([2, 0], [1, -1]), drawn(1, 2), axis=1)
                Concat(padded, taken, replaced, axis=1)";
    assert_eq!(found(text, OBS + 3 + 3 + OBS)?, "linear");
    Ok(())
}

#[test]
fn convolutions_over_few_positions_are_products() -> Result<()> {
    for (text, len) in [
        ("Conv(Reshape(x, [1, 8, 4]), drawn(6, 8, 1), drawn(6))", 24),
        ("Conv(Reshape(x, [1, 8, 4]), drawn(6, 8, 3), drawn(6), pads=[1, 1], strides=[2])", 12),
        ("Conv(Reshape(x, [1, 4, 8]), drawn(6, 2, 2), drawn(6), group=2, dilations=[3])", 30),
        ("Conv(Reshape(x, [1, 8, 4]), drawn(6, 8, 2), drawn(6), auto_pad=\"SAME_UPPER\")", 24),
        ("Conv(Reshape(x, [1, 2, 4, 4]), drawn(3, 2, 2, 3), drawn(3))", 18),
    ] {
        let file = network(&format!("x = gemm(obs, 32, 11)\nRelu(Flatten({text}))"), len);
        same(&file).with_context(|| text.to_owned())?;
    }
    let image = of_input("image", &[1, 3, 16, 16], "Flatten(Conv(image, drawn(4, 3, 3, 3)))", 784);
    refused(&image, "(Conv): has 196 positions with 1 groups; the limit of positions times groups is 64");
    let history = of_input("history", &[1, 8, 10], "Flatten(Conv(history, drawn(8, 1, 1), group=8))", 80);
    refused(&history, "has 10 positions with 8 groups; the limit of positions times groups is 64");
    Ok(())
}

#[test]
fn transposed_values_are_computed_in_order() -> Result<()> {
    between(&[(
        "silu",
        "x = Transpose(Reshape(x, [1, 4, 4]), perm=[0, 2, 1])
         Reshape(Transpose(x * Sigmoid(x), perm=[0, 2, 1]), [1, 16])",
    )])
}

#[test]
fn einsums_with_constants_are_products() -> Result<()> {
    for text in [
        "Einsum(x, drawn(16, 16), equation=\"bi,oi->bo\")",
        "Einsum(x, drawn(16, 16), equation=\"bi,io->bo\")",
        "Einsum(Reshape(x, [1, 4, 4]), drawn(2, 4, 2), equation=\"btd,hdk->bhtk\")",
    ] {
        let file = network(&format!("x = gemm(obs, 16, 11)\nTanh(Flatten({text}))"), 16);
        same(&file).with_context(|| text.to_owned())?;
    }
    Ok(())
}

#[test]
fn norms_of_groups_are_norms_of_rows() -> Result<()> {
    // torch's GroupNorm: an instance norm of [1, group, ..], then a factor and an offset for each channel.
    let text = "x = Reshape(gemm(obs, 16, 11), [1, 4, 4])
                x = InstanceNormalization(x, full(1, 4), full(0, 4), epsilon=1e-5)
                Reshape(x, [1, 16]) * drawn(16) + drawn(16)";
    assert_eq!(same(&network(text, 16))?.ops.iter().filter(|op| *op == "layernorm").count(), 4);
    Ok(())
}

fn node(op: &str, inputs: &[&str], outputs: &[&str], attributes: &[proto::Attribute]) -> Bytes {
    encoded(&proto::Node {
        op_type: Some(op.to_owned()),
        input: inputs.iter().map(|&name| name.to_owned()).collect(),
        output: outputs.iter().map(|&name| name.to_owned()).collect(),
        attribute: attributes.iter().map(encoded).collect(),
        ..Default::default()
    })
}

/// An overload of the function `Act`, which computes `y` from `x`.
fn function(overload: &str, node: Vec<Bytes>, attribute_proto: Vec<Bytes>) -> Bytes {
    encoded(&proto::Function {
        name: Some("Act".to_owned()),
        domain: Some("local".to_owned()),
        overload: Some(overload.to_owned()),
        input: vec!["x".to_owned()],
        output: vec!["y".to_owned()],
        attribute_proto,
        node,
    })
}

/// Requires that two layers with calls of functions between them agree with those with plain nodes. `between` adds the
/// calls, or the nodes, after a value.
fn same_as_called(functions: Vec<Bytes>, between: impl Fn(&mut File, String, bool) -> String) -> Result<()> {
    let network = |called: bool| {
        let mut file = begun();
        let x = file.gemm("obs", 16, OBS);
        let x = between(&mut file, x, called);
        let y = file.gemm(&x, 3, 16);
        file.nodes("Identity", &[&y], &["actions"], &[]);
        file.output("actions", &[1, 3]);
        file.model()
    };
    let plain = network(false).encode_to_vec();
    let called = proto::Model { functions, ..network(true) }.encode_to_vec();
    let [ours, theirs] = [called, plain].map(|bytes| imported(&bytes, &Choice::default()));
    let (ours, theirs) = (ours?.1, theirs?.1);
    let observations = drawn(&ours);
    compare(&actions(&theirs, &observations), &actions(&ours, &observations))
}

#[test]
fn function_overloads_are_distinguished() -> Result<()> {
    let overloads = [("first", "Tanh"), ("second", "Elu")];
    let functions = overloads.map(|(overload, op)| function(overload, vec![node(op, &["x"], &["y"], &[])], Vec::new()));
    same_as_called(functions.to_vec(), |file, x, called| {
        overloads.iter().fold(
            x,
            |x, (overload, op)| {
                if called { file.call(overload, &x) } else { file.node(op, &[&x], &[]) }
            },
        )
    })
}

/// An attribute of a function that a branch in it names, as torch's library of functions has them.
#[test]
fn attributes_of_a_function_reach_its_branches() -> Result<()> {
    let named = |name: &str| proto::Attribute { name: Some(name.to_owned()), ..Default::default() };
    let slope = proto::Attribute { ref_attr_name: Some("slope".to_owned()), ..named("alpha") };
    let output = proto::ValueInfo { name: Some("inner".to_owned()), r#type: None };
    let branch = |op: &str, attributes: &[proto::Attribute]| {
        let nodes = vec![node(op, &["x"], &["inner"], attributes)];
        Some(encoded(&proto::Graph { node: nodes, output: vec![encoded(&output)], ..Default::default() }))
    };
    let truth = proto::Tensor { data_type: Some(9), raw_data: Some(vec![1].into()), ..Default::default() };
    let truth = proto::Attribute { t: Some(encoded(&truth)), ..named("value") };
    let branches = [
        proto::Attribute { g: branch("LeakyRelu", &[slope]), ..named("then_branch") },
        proto::Attribute { g: branch("Tanh", &[]), ..named("else_branch") },
    ];
    let nodes = vec![node("Constant", &[], &["yes"], &[truth]), node("If", &["yes"], &["y"], &branches)];
    let function = function("only", nodes, vec![encoded(&proto::Attribute { f: Some(0.4), ..named("slope") })]);
    same_as_called(vec![function], |file, x, called| {
        if called { file.call("only", &x) } else { file.node("LeakyRelu", &[&x], &[("alpha", Value::Real(0.4))]) }
    })
}

#[test]
fn ambiguous_files_are_refused() -> Result<()> {
    let file = whole("actions := Identity(gemm(Tanh(obs), 3, 11))", 3);
    same(&file.bytes())?;
    let with_opset = |version: Option<i64>| {
        let set = |version| encoded(&proto::OperatorSet { domain: None, version: Some(version) });
        proto::Model { opset_import: version.map(set).into_iter().collect(), ..file.model() }.encode_to_vec()
    };
    refused(&with_opset(None), "does not give the version of its ONNX operators");
    refused(&with_opset(Some(6)), "export it with opset 7 or above");
    let of_rows = |inputs: &[(&str, &[i64])], text: &str| {
        let mut file = File::default();
        inputs.iter().for_each(|(name, dims)| file.input(name, dims));
        file.write(&[], text);
        file.output("actions", &[4, 3]);
        file.bytes()
    };
    // A batch, not a chunk of actions.
    let batch = of_rows(&[("obs", &[4, 11])], "actions := Tanh(gemm(obs, 3, 11))");
    refused(&batch, "have 4 rows, which is a batch");
    // A batch beside an input of one row.
    let text = "actions := gemm(command, 3, 2) + gemm(obs, 3, 11)";
    let batch = of_rows(&[("command", &[1, 2]), ("obs", &[4, 11])], text);
    refused(&batch, "the action and the input \"obs\" have 4 rows, which is a batch");
    // A vector with as many values as the chunk has actions is no batch.
    let chunk = of_rows(&[("x", &[4])], "actions := Reshape(MatMul(x, drawn(4, 12)), [4, 3])");
    assert_eq!(imported(&chunk, &Choice::default())?.0.output.1, 12);
    Ok(())
}

#[test]
fn limits_far_from_zero_lose_no_digits() -> Result<()> {
    // A million is far beyond the output of a layer, about 1: subtracting and adding it would lose 0.06.
    between(&[
        ("normalize normalize relu add", "Clip(x, -1e6, )"),
        ("normalize normalize relu normalize add", "Clip(x, , 1e6)"),
        ("relu normalize", "Clip(x, 0, 1e6)"),
        // One clip has two limits in sequence.
        ("normalize", "Clip(Clip(x, -1e6, ), , 1e6)"),
        ("relu normalize", "Clip(Relu(x), , 6)"),
        (
            "normalize",
            "above = Greater(x, 0.3)
             below = Less(x, -0.3)
             Where(above, 0.3, Where(below, -0.3, x))",
        ),
    ])?;
    // A limit for each value, on either side of zero, or none.
    let limits: Vec<f32> =
        (0..16).map(|i| [-1e6, -0.2, 0.0, 0.1, 5.0, -40.0, -3e4, f32::NEG_INFINITY][i % 8]).collect();
    for (op, sign) in [("Max", 1.0), ("Min", -1.0)] {
        let mut file = begun();
        let limits: Vec<f32> = limits.iter().map(|limit| sign * limit).collect();
        let limits = file.reals(&[16], &limits);
        let x = file.write(&[&limits], &format!("{op}(gemm(obs, 16, 11), x)"));
        same(&ended(file, &x, 16)).with_context(|| op.to_owned())?;
    }
    Ok(())
}

#[test]
fn network_values_count_as_finite() -> Result<()> {
    between(&[
        // nan_to_num
        ("relu", "Relu(Where(IsInf(x), 3e38, Where(IsNaN(x), 0.0, x)))"),
        // The same by torch's exporter: infinite, and above 0.
        ("relu", "Relu(Where(And(IsInf(x), Cast(Greater(x, 0.0), to=9)), 3e38, x))"),
        // jax.numpy.logaddexp(x, 0)
        ("softplus", "Where(Not(Equal(x, x)), x, Max(x, 0.0) + Log(Exp(Neg(Abs(x))) + 1.0))"),
    ])
}

#[test]
fn max_min_and_mean_over_positions_are_found() -> Result<()> {
    // A set of points, each through one layer; only their pooled values remain.
    for pool in [
        "ReduceMax(x, axes=[2], keepdims=1)",
        "ReduceMin(x, axes=[2], keepdims=1)",
        "GlobalMaxPool(x)",
        "GlobalAveragePool(x)",
        "ReduceL1(x, axes=[2], keepdims=1)",
    ] {
        let text = format!("x = Transpose(MatMul(points, drawn(3, 8)), perm=[0, 2, 1])\nFlatten({pool})");
        same(&of_input("points", &[1, 5, 3], &text, 8)).with_context(|| pool.to_owned())?;
    }
    let many = of_input("points", &[1, 65, 1], "ReduceMax(points, axes=[1], keepdims=0)", 1);
    refused(&many, "(ReduceMax): takes the maximum or minimum of 65 values; the limit is 64");
    Ok(())
}

#[test]
fn batched_matrices_become_several_products() -> Result<()> {
    // An ensemble of three, as from torch.bmm.
    let text = "x = Tanh(MatMul(obs, drawn(3, 11, 8)) + drawn(3, 1, 8))
                ReduceMean(MatMul(x, drawn(3, 8, 5)), axes=[0], keepdims=0)";
    let found = found(text, 5)?;
    assert_eq!(found.matches("linear").count(), 7, "{found}");
    Ok(())
}

#[test]
fn norms_accept_constants_beside_values() -> Result<()> {
    // SimbaV2: an L2 norm of the observation and a constant.
    let text = "x = Concat(obs, full(3, 1, 1), axis=1)
                x / ReduceL2(x, axes=[1], keepdims=1)";
    assert_eq!(found(text, OBS + 1)?, "linear rmsnorm linear");
    Ok(())
}

#[test]
fn one_value_joins_with_many() -> Result<()> {
    // The time of a denoising step, and its 150 frequencies.
    let text = "x = time * drawn(1, 150)
                Concat(Sin(x), Cos(x), axis=1)";
    assert_eq!(ops(&of_input("time", &[1, 1], text, 300))?, "identity normalize sin cos linear");
    Ok(())
}

#[test]
fn choices_that_resemble_an_activation_are_refused() -> Result<()> {
    between(&[
        ("softplus", "Where(Greater(x, 20.0), x, Softplus(x))"),
        ("softplus", "Where(Less(x, 20.0), Softplus(x), x)"),
    ])?;
    // The linear part below the limit.
    for choice in ["Where(Less(x, 20.0), x, Softplus(x))", "Where(Greater(x, 20.0), Softplus(x), x)"] {
        refused(
            &network(&format!("x = gemm(obs, 16, 11)\n{choice}"), 16),
            "chooses by a value of the network and does not form an activation",
        );
    }
    // A limit that repeats the value: [1, 5] and [5, 1] give [5, 5].
    let text = "x = gemm(obs, 5, 11)
                Where(Greater(x, full(0, 5, 1)), x, 0.0)";
    refused(&network(text, 5), "(Greater): compares the observation");
    Ok(())
}

#[test]
fn the_same_file_gives_the_same_bytes() -> Result<()> {
    let mut file = File::default();
    file.input("b", &[1, 4]);
    file.input("a", &[1, 4]);
    // Elements of both in turn, which are computed in the order of their values.
    let x = file.write(&[], "Tanh(Reshape(Transpose(Concat(a, b, axis=0), perm=[1, 0]), [1, 8]))");
    let bytes = ended(file, &x, 8);
    let first = same(&bytes)?;
    for _ in 0..8 {
        let again = imported(&bytes, &Choice::default())?.0;
        assert_eq!((&again.json, &again.weights), (&first.json, &first.weights));
    }
    Ok(())
}
