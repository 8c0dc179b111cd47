//! Units: elements that can only be removed together ([`Ties`]). They are cell units, residual-stream elements,
//! concatenated elements, and those of attention ([`super::heads`]). A unit has a row in every matrix that makes such a
//! vector; of a cell, one for each gate. It has a column in every matrix that reads one. So a network with fewer units is
//! far smaller than one that lacks as many rows.

use std::collections::{BTreeMap, BTreeSet};

use super::dimension::{Dimension, dimensions};
use super::removal::{Effect, Reading, together};
use crate::calibrate::moments::Moments;
use crate::graph::operation::Operand;
use crate::graph::ties::Ties;
use crate::graph::{Graph, ValueId};

/// Units that reach only matrices.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Units {
    /// Their group of the network's elements.
    pub(super) group: usize,
    pub(super) len: usize,
    /// Readers of their vectors; of a cell, its state comes first.
    pub(super) readers: Vec<Reading>,
}

impl Units {
    /// Finds the readers of a group; `None` if nothing makes or reads it.
    pub(super) fn of(graph: &Graph, ties: &Ties, group: usize) -> Option<Self> {
        let mut reading = BTreeMap::<ValueId, Vec<usize>>::new();
        for (n, node) in graph.nodes.iter().enumerate() {
            for product in node.kind.products() {
                let value = if product.operand == Operand::State { n + 1 } else { node.inputs[0] };
                reading.entry(value).or_default().push(product.matrix);
            }
        }
        // The moments of a matrix are those of all tokens that it reads.
        let mut read = BTreeSet::new();
        let mut readers = Vec::new();
        for (value, matrices) in reading {
            for columns in ties.ranges(&ties.values[value], group) {
                let mut matrices = matrices.clone();
                matrices.retain(|m| read.insert((*m, columns.start)));
                readers.extend((!matrices.is_empty()).then_some(Reading { matrices, columns }));
            }
        }
        let is_made = ties.rows.iter().any(|(_, rows)| rows.contains(&group));
        (is_made && !readers.is_empty()).then(|| Self { group, len: ties.lens[group], readers })
    }

    /// Returns the errors of removing each unit together with those that matter less.
    pub(super) fn removals(&self, graph: &Graph, moments: &[&Moments], g: &[Vec<f64>]) -> Vec<f64> {
        let effects: Vec<Effect> = self.readers.iter().map(|of| Effect::of(graph, of, moments, g)).collect();
        together(&effects)
    }
}

/// Finds the units of a graph. Vectors of which single rows can be removed ([`Dimension`]) have none.
pub(super) fn units(graph: &Graph, ties: &Ties) -> Vec<Units> {
    let dimensions = dimensions(graph);
    let is_single = |group: usize| {
        let mut makers = (0..graph.matrices.len()).filter(|&m| ties.rows[m].1.contains(&group));
        makers.any(|maker| Dimension::made_by(&dimensions, maker).is_some())
    };
    ties.free.iter().filter(|group| !is_single(**group)).filter_map(|&group| Units::of(graph, ties, group)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::WeightMatrix;
    use crate::graph::ops::{Add, Linear};
    use crate::testing::{branches, layers, lstm, residual};

    fn found(graph: &Graph) -> Vec<Units> {
        units(graph, &Ties::of(graph))
    }

    /// Returns the number of units, and the matrices and first columns of what reads them.
    fn form(units: &Units) -> (usize, Vec<(Vec<usize>, usize)>) {
        let of = |of: &Reading| (of.matrices.clone(), of.columns.start);
        (units.len, units.readers.iter().map(of).collect())
    }

    #[test]
    fn cells_residual_streams_and_concatenations_have_units() {
        let forms = |graph: &Graph| found(graph).iter().map(form).collect::<Vec<_>>();
        assert_eq!(forms(&lstm()), [(3, vec![(vec![1, 2], 0)])]);
        for normed in [false, true] {
            assert_eq!(forms(&residual(4, normed)), [(4, [1, 2, 3].map(|m| (vec![m], 0)).to_vec())]);
        }
        assert_eq!(forms(&branches([4, 3])), [(4, vec![(vec![2], 0)]), (3, vec![(vec![2], 6)])]);
    }

    #[test]
    fn single_rows_are_no_units() {
        assert!(found(&layers(&[3, 5, 4, 2])).is_empty());
    }

    #[test]
    fn vectors_with_fixed_places_stay_whole() {
        // The sum is the network's output.
        let mut graph = residual(4, false);
        graph.nodes.pop();
        graph.matrices.pop();
        assert!(found(&graph).is_empty());
        // The observation takes part in the sum.
        let mut graph = Graph::new(3);
        graph.matrices.extend(residual(4, false).matrices.into_iter().take(1));
        let WeightMatrix { rows, data, .. } = &mut graph.matrices[0];
        *rows = 3;
        data.truncate(9);
        graph.matrices.push(graph.matrices[0].clone());
        graph.add(Linear { matrix: 0, bias: vec![0.0; 3] }, &[0]).expect("it fits");
        graph.add(Add, &[0, 1]).expect("it fits");
        graph.add(Linear { matrix: 1, bias: vec![0.0; 3] }, &[2]).expect("it fits");
        assert!(found(&graph).is_empty());
    }
}
