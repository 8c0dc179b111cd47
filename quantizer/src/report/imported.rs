//! What became of an ONNX file.

use actq::policy::Policy;
use actq_onnx::Imported;

/// A summary: inputs in order, the output, states, ops, what was cut, what became the action contract.
pub fn summary(imported: &Imported, policy: &Policy) -> String {
    let list = |names: &[String]| names.join(", ");
    let mut text = format!("file      {} nodes, by {}\n", imported.nodes, imported.producer);
    let mut at = 0;
    for (i, (name, len)) in imported.inputs.iter().enumerate() {
        let head = if i == 0 { "input" } else { "" };
        let integers = if imported.integers.contains(name) { ", integers" } else { "" };
        text += &format!("{head:9} obs[{at}:{}] = {name}{integers}\n", at + len);
        at += len;
    }
    for (from, to, len) in &imported.states {
        text += &format!("state     {from}, {len} values, whose next are {to}; kept by the policy, zero at reset\n");
    }
    let chunk = if policy.chunk > 1 { format!(": a chunk of {} actions", policy.chunk) } else { String::new() };
    text += &format!("output    {}, {} values{chunk}\n", imported.output.0, imported.output.1);
    if !imported.contract.is_empty() {
        text += &format!("action    the last nodes became the contract's {}\n", imported.contract.join(", "));
    }
    if imported.bounded > 0 {
        let of = format!("{} of {} actions", imported.bounded, policy.act_len);
        text +=
            &format!("limits    low and high of {of} are the bounds of their last operation (tanh, sigmoid, clip)\n");
    }
    text += &format!("ops       {}\n", list(&counted(&imported.ops)));
    text += &format!(
        "network   {} weights, {} parameters; everything else in the file is folded into them or only moves values\n",
        policy.weights, policy.parameters
    );
    for (what, names) in [("inputs", &imported.cut_inputs), ("outputs", &imported.cut_outputs)] {
        if !names.is_empty() {
            text += &format!("cut       {what} {}: the action does not need them\n", list(names));
        }
    }
    text
}

/// Neighbours that are the same, with their number.
fn counted(ops: &[String]) -> Vec<String> {
    ops.chunk_by(|a, b| a == b)
        .map(|run| if run.len() == 1 { run[0].clone() } else { format!("{} x {}", run.len(), run[0]) })
        .collect()
}
