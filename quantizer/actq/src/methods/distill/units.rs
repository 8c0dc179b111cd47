//! Elements of hidden vectors that can only be removed together: the units of a recurrent cell, and those of vectors that
//! are added, multiplied or normalized, as the residual stream of a network. A unit has a row in every matrix that makes
//! such a vector, one for each gate of a cell, and a column in every matrix that reads one. So a network with fewer units
//! is far smaller than one that lacks as many rows.

use std::collections::BTreeMap;

use super::dimension::uses;
use super::removal::{Effect, together};
use crate::calibrate::moments::Moments;
use crate::graph::operation::Operand;
use crate::graph::{Graph, NodeKind, ValueId};

/// Units that reach only matrices. Numbers are indices of the graph's nodes and matrices.
#[derive(Clone, Debug, Default)]
pub(super) struct Units {
    /// Nodes whose outputs have an element of each unit.
    pub(super) nodes: Vec<usize>,
    /// Number of units.
    pub(super) len: usize,
    /// Matrices with a row of each unit, for every gate of a cell.
    pub(super) makers: Vec<usize>,
    /// Matrices with a column of each unit; those that read the same vector together, and first that of a cell's state.
    pub(super) readers: Vec<Vec<usize>>,
}

impl Units {
    /// Returns the errors of removing each unit together with those that matter less.
    pub(super) fn removals(&self, graph: &Graph, moments: &[&Moments], g: &[Vec<f64>]) -> Vec<f64> {
        let effects: Vec<Effect> = self.readers.iter().map(|of| Effect::of(graph, of, moments, g)).collect();
        together(&effects)
    }
}

/// Finds the units of a graph. Vectors of which single rows can be removed have none: see
/// [`Dimension`](super::dimension::Dimension).
pub(super) fn units(graph: &Graph) -> Vec<Units> {
    let ties = Ties::of(graph);
    let mut found = BTreeMap::<ValueId, (Units, bool)>::new();
    let mut reading = BTreeMap::<ValueId, Vec<usize>>::new();
    for (n, node) in graph.nodes.iter().enumerate() {
        let (units, tied) = found.entry(ties.root(n + 1)).or_default();
        units.nodes.push(n);
        units.len = node.len;
        let products = node.kind.products();
        units.makers.extend(products.iter().map(|product| product.matrix));
        *tied |= units.makers.len() > 1 || !matches!(node.kind, NodeKind::Linear(_) | NodeKind::Pointwise(_));
        for product in products {
            let value = if product.operand == Operand::State { n + 1 } else { node.inputs[0] };
            reading.entry(value).or_default().push(product.matrix);
        }
    }
    for (value, matrices) in reading {
        if let Some((units, _)) = found.get_mut(&ties.root(value)) {
            units.readers.push(matrices);
        }
    }
    let of = |(root, (units, tied)): (ValueId, (Units, bool))| {
        (tied && !ties.fixed[root] && !units.makers.is_empty() && !units.readers.is_empty()).then_some(units)
    };
    found.into_iter().filter_map(of).collect()
}

/// Values whose elements depend on each other.
struct Ties {
    /// A value that each is tied to; itself if none.
    to: Vec<ValueId>,
    /// Values that stay whole, by their roots.
    fixed: Vec<bool>,
}

impl Ties {
    fn of(graph: &Graph) -> Self {
        let values = graph.nodes.len() + 1;
        let mut ties = Self { to: (0..values).collect(), fixed: vec![false; values] };
        ties.fix(0);
        for (n, node) in graph.nodes.iter().enumerate() {
            let of_node = node.inputs.iter().copied().chain([n + 1]);
            match &node.kind {
                NodeKind::Add(_)
                | NodeKind::Mul(_)
                | NodeKind::LayerNorm(_)
                | NodeKind::RmsNorm(_)
                | NodeKind::Pointwise(_) => node.inputs.iter().for_each(|&input| ties.tie(input, n + 1)),
                NodeKind::Linear(_) | NodeKind::Lstm(_) | NodeKind::Gru(_) => {
                    if node.kind.products().iter().any(|product| uses(graph, product.matrix) > 1) {
                        of_node.for_each(|value| ties.fix(value));
                    }
                }
                NodeKind::Table(_) => {}
                NodeKind::Normalize(_) | NodeKind::Balance(_) | NodeKind::Concat(_) | NodeKind::Iterate(_) => {
                    of_node.for_each(|value| ties.fix(value));
                }
            }
        }
        ties.fix(graph.output());
        ties
    }

    fn root(&self, mut value: ValueId) -> ValueId {
        while self.to[value] != value {
            value = self.to[value];
        }
        value
    }

    fn fix(&mut self, value: ValueId) {
        let root = self.root(value);
        self.fixed[root] = true;
    }

    fn tie(&mut self, a: ValueId, b: ValueId) {
        let (a, b) = (self.root(a), self.root(b));
        self.fixed[a] |= self.fixed[b];
        self.to[b] = a;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::WeightMatrix;
    use crate::graph::ops::{Add, Linear};
    use crate::testing::{layers, lstm, residual};

    #[test]
    fn cells_and_residual_streams_have_units() {
        let [cell] = &units(&lstm())[..] else { panic!("one cell") };
        assert_eq!((cell.len, &cell.makers[..], &cell.readers[..]), (3, &[0, 1][..], &[vec![1, 2]][..]));
        let [stream] = &units(&residual(false))[..] else { panic!("one stream") };
        assert_eq!((stream.len, stream.nodes.len()), (4, 8));
        assert_eq!((&stream.makers[..], &stream.readers[..]), (&[0, 1, 2][..], &[vec![1], vec![2], vec![3]][..]));
        let [normed] = &units(&residual(true))[..] else { panic!("one stream") };
        assert_eq!((normed.nodes.len(), &normed.readers), (9, &stream.readers));
    }

    #[test]
    fn rows_that_can_be_removed_alone_are_no_units() {
        assert!(units(&layers(&[3, 5, 4, 2])).is_empty());
    }

    #[test]
    fn vectors_with_fixed_places_stay_whole() {
        // The sum is the network's output.
        let mut graph = residual(false);
        graph.nodes.pop();
        graph.matrices.pop();
        assert!(units(&graph).is_empty());
        // The observation takes part in the sum.
        let mut graph = Graph::new(3);
        graph.matrices.extend(residual(false).matrices.into_iter().take(1));
        let WeightMatrix { rows, data, .. } = &mut graph.matrices[0];
        *rows = 3;
        data.truncate(9);
        graph.matrices.push(graph.matrices[0].clone());
        graph.add(Linear { matrix: 0, bias: vec![0.0; 3] }, &[0]).expect("it fits");
        graph.add(Add, &[0, 1]).expect("it fits");
        graph.add(Linear { matrix: 1, bias: vec![0.0; 3] }, &[2]).expect("it fits");
        assert!(units(&graph).is_empty());
    }
}
