//! Values whose units the network fixes, and the columns of matrices that read them: those computed from the observation
//! without a matrix, and hidden ones that functions such as tanh tie to their units. Other hidden values are equalized
//! (`calibrate/equalize.rs`).

use crate::calibrate::equalize::fixed_values;
use crate::graph::operation::Operand;
use crate::graph::ops::{Concat, Span};
use crate::graph::{Graph, NodeKind, ValueId};

/// A value whose units the network fixes, and the columns that read it.
#[derive(Clone, Debug)]
pub(super) struct Site {
    /// Identifier of the value.
    pub(super) value: ValueId,
    /// `true` if the policy normalizes all of it, or a matrix made it: its units are those of the training.
    pub(super) is_normalized: bool,
    /// `true` if it is computed from the observation without a matrix.
    pub(super) is_observed: bool,
    /// Nodes that read the value only through these columns.
    pub(super) readers: Vec<usize>,
    /// Readings of the value, one for each matrix.
    pub(super) readings: Vec<Reading>,
}

/// Columns of a matrix, with the elements of a value that they read.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Reading {
    pub(super) matrix: usize,
    /// Element of the value that each column reads; `None` for a column that reads another value.
    pub(super) elements: Vec<Option<usize>>,
}

impl Reading {
    /// Iterates over the columns that read the value, each with its element.
    pub(super) fn columns(&self) -> impl Iterator<Item = (usize, usize)> {
        self.elements.iter().enumerate().filter_map(|(column, element)| Some((column, (*element)?)))
    }

    /// `true` if the matrix also reads another value.
    pub(super) fn is_partial(&self) -> bool {
        self.elements.contains(&None)
    }

    /// Spreads `values`, one for each element, over the columns; a column without an element gets `other`.
    pub(super) fn spread(&self, values: &[f64], other: f64) -> Vec<f64> {
        self.elements.iter().map(|element| element.map_or(other, |element| values[element])).collect()
    }
}

/// Lists the sites of a network, in the order of their values.
pub(super) fn sites(graph: &Graph) -> Vec<Site> {
    let (mut observed, mut normalized) = (vec![true], vec![false]);
    for node in &graph.nodes {
        let all = |of: &[bool]| !node.inputs.is_empty() && node.inputs.iter().all(|&value| of[value]);
        observed.push(all(&observed) && node.kind.products().is_empty());
        normalized.push(all(&normalized) || matches!(node.kind, NodeKind::Normalize(_) | NodeKind::Balance(_)));
    }
    let site = |value: ValueId| {
        let (readers, mut readings) = keep_consistent(graph, readers(graph, &observed, value));
        readings.sort_unstable();
        readings.dedup();
        let is_observed = observed[value];
        let is_normalized = normalized[value] || !is_observed;
        (!readings.is_empty()).then_some(Site { value, is_normalized, is_observed, readers, readings })
    };
    let fixed = fixed_values(graph);
    let is_joined = |value: usize| value > 0 && matches!(graph.nodes[value - 1].kind, NodeKind::Concat(_));
    let has_site = |&value: &usize| observed[value] || fixed[value] && !is_joined(value);
    (0..observed.len()).filter(has_site).filter_map(site).collect()
}

/// Finds the nodes that read a value only through columns of matrices.
fn readers(graph: &Graph, observed: &[bool], value: ValueId) -> Vec<(usize, Vec<Reading>)> {
    let whole: Vec<Option<usize>> = (0..graph.len_of(value)).map(Some).collect();
    let of = |n: usize| readings(graph, observed, n, value, &whole).map(|readings| (n, readings));
    graph.readers(value).into_iter().filter_map(of).filter(|(_, readings)| !readings.is_empty()).collect()
}

/// Finds the readings of a value of these elements by node `n`; `None` if the node reads it other than through
/// matrices. A value that is joined only with other values of the observation has its own site.
fn readings(
    graph: &Graph,
    observed: &[bool],
    n: usize,
    value: ValueId,
    elements: &[Option<usize>],
) -> Option<Vec<Reading>> {
    let (node, joined) = (&graph.nodes[n], n + 1);
    let NodeKind::Concat(Concat(spans)) = &node.kind else {
        let products = node.kind.products().into_iter().filter(|product| product.operand == Operand::Input);
        let of = |matrix: usize| Reading { matrix, elements: elements.to_vec() };
        let readings: Vec<Reading> = products.map(|product| of(product.matrix)).collect();
        return (!readings.is_empty()).then_some(readings);
    };
    if observed[joined] || joined == graph.output() {
        return None;
    }
    let part = |(input, span): (&ValueId, &Span)| match *input == value {
        true => elements[span.from..][..span.len].to_vec(),
        false => vec![None; span.len],
    };
    let elements = node.inputs.iter().zip(spans).map(part).collect::<Vec<_>>().concat();
    let of = |next: usize| readings(graph, observed, next, joined, &elements);
    graph.readers(joined).into_iter().map(of).collect::<Option<Vec<_>>>().map(|all| all.concat())
}

/// Keeps the readers whose matrices have the same reading in all products: a matrix has one set of columns.
fn keep_consistent(graph: &Graph, mut readers: Vec<(usize, Vec<Reading>)>) -> (Vec<usize>, Vec<Reading>) {
    loop {
        let all: Vec<Reading> = readers.iter().flat_map(|(_, readings)| readings.clone()).collect();
        let count_equal = |reading: &Reading| all.iter().filter(|other| *other == reading).count();
        let count_before = readers.len();
        readers.retain(|(_, readings)| readings.iter().all(|r| count_products(graph, r.matrix) == count_equal(r)));
        if readers.len() == count_before {
            return (readers.into_iter().map(|(n, _)| n).collect(), all);
        }
    }
}

/// Counts the products that use a matrix.
fn count_products(graph: &Graph, matrix: usize) -> usize {
    graph.nodes.iter().flat_map(|node| node.kind.products()).filter(|product| product.matrix == matrix).count()
}
