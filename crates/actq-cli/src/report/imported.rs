//! The summary of an imported ONNX file.

use actq::policy::Policy;
use actq::text::count;
use actq_onnx::Imported;

/// Formats the summary: inputs in order, states, the output, the action contract, ops, and cut inputs and outputs.
pub fn summary(imported: &Imported, policy: &Policy) -> String {
    let list = |names: &[String]| names.join(", ");
    let mut text = format!("file      {}, by {}\n", count(imported.nodes, "node"), imported.producer);
    text += &imported.ports();
    if !imported.contract.is_empty() {
        text += &format!("action    contract with {}, from the last nodes\n", imported.contract.join(", "));
    }
    if imported.bounded > 0 {
        let of = format!("{} of {}", imported.bounded, count(policy.act_len, "action"));
        text +=
            &format!("limits    low and high of {of} are the bounds of their last operation (tanh, sigmoid, clip)\n");
    }
    text += &format!("ops       {}\n", list(&counted(&imported.ops)));
    text += &format!(
        "network   {}, {}; all other nodes are folded into them or only move values\n",
        count(policy.weights, "weight"),
        count(policy.parameters, "parameter")
    );
    for (i, axis) in imported.unsized_axes.iter().enumerate() {
        text += &format!("{:9} {axis}\n", if i == 0 { "axes" } else { "" });
    }
    for (i, guard) in imported.guards.iter().enumerate() {
        text += &format!("{:9} {guard}\n", if i == 0 { "guard" } else { "" });
    }
    if !imported.guards.is_empty() {
        text += "          the image has none of these: a step with NaN or infinity in its observation is refused, and the application \
                 must replace such values before the step\n";
    }
    text + &imported.cut()
}

/// Formats successive equal names as one name with their count.
fn counted(ops: &[String]) -> Vec<String> {
    ops.chunk_by(|a, b| a == b)
        .map(|run| if run.len() == 1 { run[0].clone() } else { format!("{} x {}", run.len(), run[0]) })
        .collect()
}
