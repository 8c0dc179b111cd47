//! Values that depend on the observation through no matrix, and the columns of matrices that read them.

use crate::graph::operation::Operand;
use crate::graph::ops::{Concat, Span};
use crate::graph::{Graph, NodeKind, ValueId};

/// A value of the observation, and the columns that read it.
#[derive(Clone, Debug)]
pub(super) struct Site {
    /// The value.
    pub(super) value: ValueId,
    /// The policy normalizes all of it.
    pub(super) normalized: bool,
    /// The nodes that read the value through nothing but these columns.
    pub(super) readers: Vec<usize>,
    /// Each matrix once.
    pub(super) readings: Vec<Reading>,
}

/// How a matrix reads a value.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Reading {
    /// The matrix.
    pub(super) matrix: usize,
    /// The element of the value that each column reads; `None` for a column that reads another value.
    pub(super) elements: Vec<Option<usize>>,
}

impl Reading {
    /// The columns that read the value, each with its element.
    pub(super) fn columns(&self) -> impl Iterator<Item = (usize, usize)> {
        self.elements.iter().enumerate().filter_map(|(column, element)| Some((column, (*element)?)))
    }

    /// Whether the matrix also reads another value.
    pub(super) fn is_partial(&self) -> bool {
        self.elements.contains(&None)
    }

    /// What belongs to each column: of `values`, the one of its element; `other` for a column without.
    pub(super) fn spread(&self, values: &[f64], other: f64) -> Vec<f64> {
        self.elements.iter().map(|element| element.map_or(other, |element| values[element])).collect()
    }
}

/// The sites of a network, in the order of their values.
pub(super) fn sites(graph: &Graph) -> Vec<Site> {
    let (mut observed, mut normalized) = (vec![true], vec![false]);
    for node in &graph.nodes {
        let all = |of: &[bool]| !node.inputs.is_empty() && node.inputs.iter().all(|&value| of[value]);
        observed.push(all(&observed) && node.kind.products().is_empty());
        normalized.push(all(&normalized) || matches!(node.kind, NodeKind::Normalize(_) | NodeKind::Balance(_)));
    }
    let site = |value: ValueId| {
        let (readers, mut readings) = alone(graph, readers(graph, &observed, value));
        readings.sort_unstable();
        readings.dedup();
        (!readings.is_empty()).then_some(Site { value, normalized: normalized[value], readers, readings })
    };
    (0..observed.len()).filter(|&value| observed[value]).filter_map(site).collect()
}

/// The nodes that read a value through columns of matrices alone.
fn readers(graph: &Graph, observed: &[bool], value: ValueId) -> Vec<(usize, Vec<Reading>)> {
    let whole: Vec<Option<usize>> = (0..graph.len_of(value)).map(Some).collect();
    let of = |n: usize| readings(graph, observed, n, value, &whole).map(|readings| (n, readings));
    graph.readers(value).into_iter().filter_map(of).filter(|(_, readings)| !readings.is_empty()).collect()
}

/// How node `n` reads a value of these elements; `None` if it reads it otherwise than through matrices. A value that
/// is joined with others of the observation alone has a site of its own.
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

/// Those readers whose matrices are read in one way everywhere: a matrix has one set of columns.
fn alone(graph: &Graph, mut readers: Vec<(usize, Vec<Reading>)>) -> (Vec<usize>, Vec<Reading>) {
    loop {
        let all: Vec<Reading> = readers.iter().flat_map(|(_, readings)| readings.clone()).collect();
        let alike = |reading: &Reading| all.iter().filter(|other| *other == reading).count();
        let before = readers.len();
        readers.retain(|(_, readings)| readings.iter().all(|r| uses(graph, r.matrix) == alike(r)));
        if readers.len() == before {
            return (readers.into_iter().map(|(n, _)| n).collect(), all);
        }
    }
}

/// How many products use a matrix.
fn uses(graph: &Graph, matrix: usize) -> usize {
    graph.nodes.iter().flat_map(|node| node.kind.products()).filter(|product| product.matrix == matrix).count()
}
