//! Matrices that read observations in units far apart, and whose columns could not be balanced.

use super::columns::{deviations, lost_bits};
use crate::calibrate::moments::Moments;
use crate::graph::operation::Operand;
use crate::graph::ops::{Concat, Span};
use crate::graph::{Graph, NodeKind, ValueId};
use crate::numbers::square;

/// Minimum loss from units that is worth a warning, in bits per weight.
const FAR_APART: f64 = 3.0;

/// A matrix that reads observations in units far apart.
#[derive(Clone, Debug, PartialEq)]
pub struct MixedUnits {
    /// Name of the matrix.
    pub matrix: String,
    /// Indices of the observations in the largest and in the smallest unit.
    pub observations: [usize; 2],
    /// Loss from the units, in bits per weight.
    pub bits: f64,
}

/// Lists the matrices of a balanced network that read observations in units far apart; `moments` are those of their
/// inputs.
pub fn mixed_units(graph: &Graph, moments: &[Moments]) -> Vec<MixedUnits> {
    let of_node = |n: usize| {
        let (node, products) = (&graph.nodes[n], graph.nodes[n].kind.products().into_iter());
        let inputs = products.filter(|product| product.operand == Operand::Input);
        inputs.map(|product| (product.matrix, observations(graph, node.inputs[0])))
    };
    let mut mixed: Vec<MixedUnits> = (0..graph.nodes.len())
        .flat_map(of_node)
        .filter_map(|(matrix, observations)| furthest(graph, matrix, &observations, &moments[matrix]))
        .collect();
    mixed.dedup_by(|a, b| a.matrix == b.matrix);
    mixed
}

/// Returns the observation that each element of a value is; `None` for a computed element.
fn observations(graph: &Graph, value: ValueId) -> Vec<Option<usize>> {
    let Some(node) = value.checked_sub(1).map(|n| &graph.nodes[n]) else {
        return (0..graph.obs_len).map(Some).collect();
    };
    let NodeKind::Concat(Concat(spans)) = &node.kind else { return vec![None; node.len] };
    let part = |(input, span): (&ValueId, &Span)| observations(graph, *input)[span.from..][..span.len].to_vec();
    node.inputs.iter().zip(spans).map(part).collect::<Vec<_>>().concat()
}

/// Finds the observations whose units in a matrix are furthest apart, if the loss is worth a warning.
fn furthest(graph: &Graph, m: usize, observations: &[Option<usize>], moments: &Moments) -> Option<MixedUnits> {
    let matrix = &graph.matrices[m];
    let energies = matrix.column_energies();
    let deviations = deviations(moments);
    let read = |(c, observation): (usize, &Option<usize>)| {
        let (weights, values) = (energies[c], square(deviations[c]));
        (weights > 0.0 && values > 0.0).then_some(((*observation)?, weights, values))
    };
    let columns: Vec<(usize, f64, f64)> = observations.iter().enumerate().filter_map(read).collect();
    let (weights, values): (Vec<f64>, Vec<f64>) = columns.iter().map(|(_, a, h)| (a, h)).unzip();
    // In a unit `n` times finer, values are `n` times as large and weights one in `n`.
    let by_fineness = |(_, a, h): &&(usize, f64, f64), (_, b, k): &&(usize, f64, f64)| (h / a).total_cmp(&(k / b));
    let [coarsest, finest] = [columns.iter().min_by(by_fineness)?.0, columns.iter().max_by(by_fineness)?.0];
    let bits = lost_bits(&weights, &values);
    (bits >= FAR_APART).then(|| MixedUnits { matrix: matrix.name.clone(), observations: [coarsest, finest], bits })
}
