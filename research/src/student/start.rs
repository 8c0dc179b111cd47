//! Random weights, from which a student learns.

use actq::graph::{Graph, NodeKind};
use actq::random::Random;
use actq_kernels::math::Function;

/// Replaces all weights. Matrices get normal numbers of He's deviation (2015, `sqrt(2 / columns)` before a rectifier),
/// or of `sqrt(1 / columns)` elsewhere. Biases become 0, those of an LSTM's forget gate by 1; norms by 1. `units` has
/// the usual size of each column's operand for matrices that read observations: their weights are divided by it.
pub fn restart(graph: &mut Graph, units: &[Option<Vec<f32>>], random: &mut Random) {
    let gains: Vec<f32> = (0..graph.matrices.len()).map(|m| gain(graph, m)).collect();
    for (m, matrix) in graph.matrices.iter_mut().enumerate() {
        let deviation = (gains[m] / matrix.cols as f32).sqrt();
        for (i, w) in matrix.data.iter_mut().enumerate() {
            let unit = units[m].as_ref().map_or(1.0, |units| units[i % matrix.cols]);
            *w = deviation * random.normal() / unit;
        }
    }
    for node in &mut graph.nodes {
        match &mut node.kind {
            NodeKind::LayerNorm(norm) => {
                norm.weight.fill(1.0);
                norm.bias.fill(0.0);
            }
            NodeKind::RmsNorm(norm) => norm.weight.fill(1.0),
            NodeKind::Table(table) => table.rows.iter_mut().for_each(|value| *value = random.normal()),
            NodeKind::Lstm(lstm) => {
                lstm.bias.fill(0.0);
                lstm.bias[lstm.hidden..2 * lstm.hidden].fill(1.0);
            }
            kind => kind.vectors_mut().into_iter().for_each(|vector| vector.fill(0.0)),
        }
    }
}

/// Returns the variance that a matrix's outputs should have: 2 before a function that stops about half of them.
fn gain(graph: &Graph, matrix: usize) -> f32 {
    let uses = |n: &usize| graph.nodes[*n].kind.products().iter().any(|product| product.matrix == matrix);
    let stops = |n: usize| match &graph.nodes[n].kind {
        NodeKind::Pointwise(function) => matches!(
            function.0,
            Function::Relu | Function::Elu | Function::Silu | Function::Gelu | Function::GeluTanh | Function::Mish
        ),
        _ => false,
    };
    let mut followers = (0..graph.nodes.len()).filter(uses).flat_map(|n| graph.readers(n + 1));
    if followers.any(stops) { 2.0 } else { 1.0 }
}
