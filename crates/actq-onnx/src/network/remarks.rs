//! Remarks on a file: what its graph does with values that are not finite, and operators that it must not have.

use std::collections::BTreeSet;

use actq::error::Result;
use actq::text::printable;

use crate::file::model::{Model, Node, Port};
use crate::nodes::follow::{Follower, Scope, needed};
use crate::values::compare::uniform;
use crate::values::expr::{Expr, Exprs, Guard, Id};

/// The most nodes between a test and the choice by it.
const MAX_BETWEEN: usize = 6;

/// Operators of the importer that are younger than the oldest set it reads, with their first operator sets.
const FIRST_SETS: [(i64, &[&str]); 12] = [
    (8, &["Expand"]),
    (9, &["ConstantOfShape", "Erf", "IsNaN", "NonZero", "Sign", "Where"]),
    (10, &["DequantizeLinear", "IsInf", "Mod"]),
    (11, &["GatherElements", "GatherND", "Range", "Round", "ScatterElements", "ScatterND"]),
    (12, &["Celu", "Einsum", "GreaterOrEqual", "LessOrEqual"]),
    (14, &["HardSwish"]),
    (15, &["CastLike"]),
    (17, &["LayerNormalization"]),
    (18, &["GroupNormalization", "Mish"]),
    (20, &["Gelu"]),
    (23, &["Attention", "RMSNormalization"]),
    (24, &["Swish"]),
];

/// Lists the axes of the inputs that an action reads, after the first, that have no length.
pub(super) fn unsized_axes(model: &Model, exprs: &Exprs, live: &[Id]) -> Vec<String> {
    let inputs = live.iter().filter_map(|&id| match exprs.get(id) {
        Expr::Input(i) | Expr::Integers(i) => model.graph.inputs.get(*i),
        _ => None,
    });
    let axes = |port: &Port| {
        let shape = port.shape.iter().flatten().enumerate().skip(1);
        let open = shape.filter(|(_, len)| len.is_none()).map(|(axis, _)| axis);
        open.map(|axis| format!("axis {axis} of {} has no length: one step of time is taken", printable(&port.name)))
            .collect::<Vec<_>>()
    };
    inputs.flat_map(axes).collect()
}

/// Describes the nodes that give NaN and infinity a meaning, of those that these outputs need.
pub(super) fn guards(model: &Model, exprs: &Exprs, outputs: &[String]) -> Result<Vec<String>> {
    let needed = needed(&model.graph, &Scope::new(), outputs)?;
    let guards = exprs.guards.iter().filter(|(at, _)| needed.nodes.contains(at));
    Ok(guards
        .filter_map(|&(at, guard)| {
            let node = model.graph.nodes.get(at)?;
            let what = if guard == Guard::Nan { "NaN" } else { "infinity" };
            let mut by = BTreeSet::new();
            let name = node.outputs.first()?;
            replacements(model, name, &mut by, MAX_BETWEEN);
            let verb = match &by.into_iter().collect::<Vec<_>>()[..] {
                _ if matches!(node.op.as_str(), "Clip" | "Max" | "Min") => format!("limits {what} to a finite number"),
                [] => format!("tests for {what}"),
                by => format!("replaces {what} by {}", by.join(" and ")),
            };
            Some(format!("{} {verb}", named(at, node)))
        })
        .collect())
}

/// Collects the numbers that the graph chooses instead of a value, by a test of this name.
fn replacements(model: &Model, test: &str, found: &mut BTreeSet<String>, depth: usize) {
    let Some(depth) = depth.checked_sub(1) else { return };
    for node in model.graph.nodes.iter().filter(|node| node.inputs.iter().any(|input| input == test)) {
        match (node.op.as_str(), &node.inputs[..], node.outputs.first()) {
            ("Not" | "And" | "Or" | "Cast" | "Identity", _, Some(output)) => replacements(model, output, found, depth),
            ("Where", [condition, choices @ ..], _) if condition == test => {
                let numbers = choices.iter().filter_map(|name| Follower::new(model).value(name).ok()?.reals());
                found.extend(numbers.filter_map(|numbers| uniform(&numbers)).map(shown));
            }
            _ => {}
        }
    }
}

/// Formats a number, with an exponent if it is large.
fn shown(number: f64) -> String {
    let number = number as f32;
    if number.abs() < 1e6 { number.to_string() } else { format!("{number:e}") }
}

/// Describes each operator that is younger than the operator set which the file declares: the file is invalid.
pub(super) fn faults(model: &Model) -> Vec<String> {
    let mut faults = Vec::new();
    for (at, node) in model.graph.nodes.iter().enumerate() {
        let is_function = model.functions.keys().any(|[domain, name, _]| *domain == node.domain && *name == node.op);
        let is_own = ["", "ai.onnx"].contains(&node.domain.as_str()) && !is_function;
        let first = FIRST_SETS.iter().find(|(_, ops)| is_own && ops.contains(&&*node.op));
        if let Some((first, _)) = first.filter(|(first, _)| *first > model.opset) {
            faults.push(format!(
                "{}: {} is an operator from operator set {first} on, and the file declares {}",
                named(at, node),
                node.op,
                model.opset
            ));
        }
    }
    faults
}

fn named(at: usize, node: &Node) -> String {
    format!("node {at} {:?} ({})", node.name, node.op)
}
