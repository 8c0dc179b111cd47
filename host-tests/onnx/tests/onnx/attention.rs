//! ONNX's operator Attention, which tract does not have, against its parts.

use actq::graph::{Node, NodeKind};
use actq::measure::actions::actions;
use actq_onnx::{ImportOptions, proto};
use anyhow::{Context as _, Result, ensure};
use prost::Message as _;

use super::file::{File, encoded};
use super::{compare, drawn, imported, refused, same};

/// Begins a file of this many tokens of 6 values, with queries of 8 and keys and values of 4.
fn begun(tokens: i64) -> File {
    let mut file = File::default();
    file.input("obs", &[1, tokens, 6]);
    file
}

const LAYERS: &str = "
q = MatMul(obs, drawn(6, 8))
k = MatMul(obs, drawn(6, 4))
v = MatMul(obs, drawn(6, 4))
";

/// Writes a file of these lines, whose last one gives the `len` elements before the last layer. All weights are drawn
/// before, so that they are the same in all files.
fn written(mut file: File, lines: &str, len: usize) -> Vec<u8> {
    let (before, last) = lines.rsplit_once('\n').unwrap_or(("", lines));
    file.write(&[], &format!("{LAYERS}o = drawn({len}, 3)\n{before}\nactions := MatMul({}, o)", last.trim()));
    file.output("actions", &[1, 3]);
    file.bytes()
}

/// Requires that the operator's file gives the actions of its parts' file, which are tract's.
fn equal(operator: &[u8], parts: &[u8]) -> Result<()> {
    let of_parts = same(parts)?;
    let options = ImportOptions::default();
    let ((found, ours), (_, theirs)) = (imported(operator, &options)?, imported(parts, &options)?);
    ensure!(found.states == of_parts.states, "{:?}", found.states);
    let observations = drawn(&ours);
    compare(&actions(&theirs, &observations), &actions(&ours, &observations))
}

#[test]
fn the_operator_equals_its_parts() -> Result<()> {
    for (mask, attributes) in [("", ""), (" + Trilu(full(-inf, 4, 4), Squeeze([1]))", ", is_causal=1")] {
        let operator = format!("Flatten(Attention(q, k, v, q_num_heads=2, kv_num_heads=1, scale=0.3{attributes}))");
        let parts = format!(
            "a = Transpose(Reshape(q, [1, 4, 2, 4]), perm=[0, 2, 1, 3])
             w = Softmax(MatMul(a, Reshape(Transpose(k, perm=[0, 2, 1]), [1, 1, 4, 4])) * 0.3{mask}, axis=-1)
             Flatten(Transpose(MatMul(w, Reshape(v, [1, 1, 4, 4])), perm=[0, 2, 1, 3]))"
        );
        equal(&written(begun(4), &operator, 32), &written(begun(4), &parts, 32))?;
    }
    Ok(())
}

#[test]
fn its_past_keys_are_a_state() -> Result<()> {
    let with_states = || {
        let mut file = begun(1);
        for name in ["key", "value"] {
            file.input(&format!("past_{name}"), &[1, 1, 3, 4]);
            file.output(&format!("present_{name}"), &[1, 1, 3, 4]);
        }
        file.input("past_valid", &[1, 3]);
        file.output("present_valid", &[1, 3]);
        file
    };
    let valid = "valid = Concat(past_valid, full(1.0, 1, 1), axis=1)
                 present_valid := Slice(valid, [1], [4], [1])
                 mask = (valid - 1.0) * 1e9";
    let window = "present_key := Slice(keys, [1], [4], [2])
                  present_value := Slice(values, [1], [4], [2])";
    let operator = format!(
        "{valid}
         y, keys, values := Attention(q, k, v, mask, past_key, past_value, q_num_heads=2, kv_num_heads=1)
         {window}
         Flatten(y)"
    );
    let parts = format!(
        "{valid}
         keys = Concat(past_key, Reshape(k, [1, 1, 1, 4]), axis=2)
         values = Concat(past_value, Reshape(v, [1, 1, 1, 4]), axis=2)
         {window}
         a = Reshape(q, [1, 2, 1, 4])
         w = Softmax(MatMul(a, Transpose(keys, perm=[0, 1, 3, 2])) * 0.5 + Reshape(mask, [1, 1, 1, 4]), axis=-1)
         Flatten(MatMul(w, values))"
    );
    equal(&written(with_states(), &operator, 8), &written(with_states(), &parts, 8))
}

/// Begins a file of two tokens with keys and values of three tokens before them, of two heads.
fn with_past() -> File {
    let mut file = begun(2);
    for name in ["past_key", "past_value"] {
        file.input(name, &[1, 2, 3, 2]);
    }
    file
}

/// Keys and values from a host, before the network's own or alone: the actions are those of a policy that observes them.
#[test]
fn inputs_are_a_prefix() -> Result<()> {
    let names = ["past_key", "past_value"].map(str::to_owned).to_vec();
    let own = "Flatten(Attention(q, k, v, full(0.0, 2, 5), past_key, past_value, q_num_heads=4, kv_num_heads=2))";
    let alone = "Flatten(Attention(Transpose(Reshape(q, [1, 2, 4, 2]), perm=[0, 2, 1, 3]), past_key, past_value))";
    for (line, has_own) in [(own, true), (alone, false)] {
        let bytes = written(with_past(), line, 16);
        let (found, policy) = imported(&bytes, &ImportOptions { prefix: names.clone(), ..ImportOptions::default() })?;
        ensure!((policy.graph.own_len(), policy.graph.prefix_len) == (12, 24), "{:?}", policy.graph.prefix_len);
        let is_attention = |node: &&Node| matches!(node.kind, NodeKind::Attention(_));
        let node = policy.graph.nodes.iter().find(is_attention).context("no attention")?;
        ensure!(node.inputs.len() == if has_own { 5 } else { 3 }, "{:?}", node.inputs);
        ensure!(
            found.ports().contains("prefix    past_key, 12 values; past_value, 12 values; from a host"),
            "{}",
            found.ports()
        );
        // The heads' order differs between file and policy.
        ensure!(found.prefix.order[..4] == [0, 1, 6, 7], "{:?}", found.prefix.order);
        let rows = drawn(&policy);
        let of_file: Vec<Vec<f32>> = rows.iter().map(|row| found.of_file(row)).collect();
        let (_, observing) = imported(&bytes, &ImportOptions { observed: names.clone(), ..ImportOptions::default() })?;
        compare(&actions(&observing, &of_file), &actions(&policy, &rows))?;
    }
    Ok(())
}

#[test]
fn only_keys_and_values_are_a_prefix() {
    let refused = |line: &str, names: &[&str], expected: &str| {
        let prefix = names.iter().map(|name| (*name).to_owned()).collect();
        let bytes = written(with_past(), line, 16);
        let error = imported(&bytes, &ImportOptions { prefix, ..ImportOptions::default() }).expect_err(expected);
        assert!(format!("{error:#}").contains(expected), "{error:#} instead of {expected}");
    };
    let names = ["past_key", "past_value"];
    let attention = |key: &str, value: &str| {
        format!("Flatten(Attention(Transpose(Reshape(q, [1, 2, 4, 2]), perm=[0, 2, 1, 3]), {key}, {value}))")
    };
    let both = attention("past_key", "past_value");
    refused(&both, &["no_key"], "--prefix no_key: the file has no input of this name");
    refused(&both, &["past_key"], "pass --observe past_value; keys and values from a host are a prefix");
    refused(&attention("past_key + 1.0", "past_value"), &names, "reads 0 keys and 12 values of the prefix");
    refused(&attention("past_key + 1.0", "past_value + 1.0"), &names, "no key or value of attention");
    refused(
        &attention("past_key", "past_key"),
        &names,
        "--prefix past_value: the action does not depend on this input",
    );
    refused(&attention("past_key", "past_key"), &["past_key"], "attention reads 24 of the 12 values");
}

/// Its axis is the last from operator set 13 on.
#[test]
fn an_old_softmax_without_an_axis_is_refused() {
    let mut file = begun(4);
    file.write(&[], "s = Softmax(MatMul(obs, Transpose(obs, perm=[0, 2, 1])))\nactions := Flatten(MatMul(s, obs))");
    file.output("actions", &[1, 24]);
    let set = encoded(&proto::OperatorSet { domain: None, version: Some(12) });
    let bytes = proto::Model { opset_import: vec![set], ..file.model() }.encode_to_vec();
    refused(&bytes, "names no axis, and in operator set 12 goes over all but the first");
}
