//! Forms found in the output of PyTorch's exporters and tf2onnx (docs/records/2026-11-22-exporters.md), against tract.

use actq::measure::actions::actions;
use actq_onnx::{ImportOptions, proto};
use anyhow::Result;
use prost::Message as _;
use prost::bytes::Bytes;

use super::file::{File, Value, encoded};
use super::styles::{OBS, begun, ended, network};
use super::{compare, drawn, imported, refused, same};

#[test]
fn sums_of_equal_length_share_their_row_of_ones() -> Result<()> {
    let sums = "x = gemm(obs, 16, 11)
                tanh = ReduceSum(Tanh(x), [-1], keepdims=1)
                sin = ReduceSum(Sin(x), [-1], keepdims=1)
                Tanh(Concat(tanh, sin, axis=1))";
    let [json, _] = same(&network(sums, 2))?.source.files()?.map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
    assert!(json.contains("sum.weight") && !json.contains("sum.weight.2"), "{json}");
    Ok(())
}

#[test]
fn a_layer_added_to_all_tokens_is_computed_once() -> Result<()> {
    let added = "tokens = Reshape(gemm(obs, 24, 11), [1, 4, 6])
                 shift = Reshape(gemm(Tanh(obs), 6, 11), [1, 1, 6])
                 Reshape(Tanh(tokens + shift), [1, 24])";
    let found = same(&network(added, 24))?;
    let shapes: Vec<&[usize]> = found.source.tensors.values().map(|tensor| &tensor.shape[..]).collect();
    assert!(shapes.contains(&&[6, 11][..]), "{shapes:?}");
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
    let [ours, theirs] = [called, plain].map(|bytes| imported(&bytes, &ImportOptions::default()));
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
fn files_without_a_known_operator_set_are_refused() -> Result<()> {
    let mut file = begun();
    file.write(&[], "actions := Identity(gemm(Tanh(obs), 3, 11))");
    file.output("actions", &[1, 3]);
    same(&file.bytes())?;
    let with_opset = |version: Option<i64>| {
        let set = |version| encoded(&proto::OperatorSet { domain: None, version: Some(version) });
        proto::Model { opset_import: version.map(set).into_iter().collect(), ..file.model() }.encode_to_vec()
    };
    refused(&with_opset(None), "does not give the version of its ONNX operators");
    refused(&with_opset(Some(6)), "export it with opset 7 or above");
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
        let again = imported(&bytes, &ImportOptions::default())?.0;
        assert_eq!(again.source.files()?, first.source.files()?);
    }
    Ok(())
}
