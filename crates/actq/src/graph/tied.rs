//! Vectors that nodes have in common: a layer or norm that is applied to several tokens or positions is a node for each.
//! They stay equal while they learn, so that the image holds them once.

use std::collections::BTreeSet;

use super::{Graph, NodeKind, Vectors};

/// Groups of equal vectors, by their places among all vectors of a graph.
pub(crate) struct Tied(Vec<Vec<usize>>);

impl Tied {
    /// Finds them: biases of one matrix, and norms whose outputs go to the same matrices.
    pub(crate) fn of(graph: &Graph) -> Self {
        let mut modules: Vec<(&NodeKind, Vec<usize>, Vec<usize>)> = Vec::new();
        let mut first = 0;
        for (index, node) in graph.nodes.iter().enumerate() {
            let readers = match &node.kind {
                NodeKind::Linear(_) => Some(Vec::new()),
                NodeKind::LayerNorm(_) | NodeKind::RmsNorm(_) => matrices_after(graph, index),
                _ => None,
            };
            if let Some(readers) = readers {
                match modules.iter_mut().find(|(kind, after, _)| **kind == node.kind && *after == readers) {
                    Some((.., places)) => places.push(first),
                    None => modules.push((&node.kind, readers, vec![first])),
                }
            }
            first += node.kind.vectors().len();
        }
        let of_vector = |(kind, _, places): (&NodeKind, Vec<usize>, Vec<usize>)| -> Vec<Vec<usize>> {
            (0..kind.vectors().len()).map(|k| places.iter().map(|place| place + k).collect()).collect()
        };
        Self(modules.into_iter().filter(|(.., places)| places.len() > 1).flat_map(of_vector).collect())
    }

    /// Returns the places of all vectors but the first one of each group.
    pub(crate) fn copies(&self) -> BTreeSet<usize> {
        self.0.iter().flat_map(|group| &group[1..]).copied().collect()
    }

    /// Gives every vector of a group the sum of their derivatives.
    pub(crate) fn sum(&self, derivatives: &mut Vectors) {
        let mut all: Vec<&mut Vec<f32>> = derivatives.iter_mut().flatten().collect();
        for group in &self.0 {
            let mut sum = vec![0.0; all[group[0]].len()];
            for &place in group {
                sum.iter_mut().zip(&*all[place]).for_each(|(sum, of)| *sum += of);
            }
            group.iter().for_each(|&place| all[place].copy_from_slice(&sum));
        }
    }

    /// Gives every vector of a group what the first one has.
    pub(crate) fn take_first<T: Clone>(&self, of_vectors: &mut [T]) {
        for group in &self.0 {
            group.iter().for_each(|&place| of_vectors[place] = of_vectors[group[0]].clone());
        }
    }
}

/// Returns the matrices of the layers that read a node's output, in order; `None` if there are none.
fn matrices_after(graph: &Graph, index: usize) -> Option<Vec<usize>> {
    let matrix = |reader: usize| match &graph.nodes[reader].kind {
        NodeKind::Linear(linear) => Some(linear.matrix),
        _ => None,
    };
    let mut matrices: Vec<usize> = graph.readers(index + 1).into_iter().filter_map(matrix).collect();
    matrices.sort_unstable();
    Some(matrices).filter(|matrices| !matrices.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::budget::{Budget, Rate};
    use crate::methods::{Method, Options, PreparedMethod};
    use crate::testing::{dataset, transformer_of_modules};

    #[test]
    fn what_tokens_have_in_common_stays_equal() {
        let graph = transformer_of_modules();
        let recording = dataset(&graph, 2, 120);
        let method = PreparedMethod::new(&graph, Method::Distill, Some(&recording), |_| {}).expect("statistics");
        let groups = Tied::of(method.graph()).0;
        assert!(groups.len() > 12 && groups.iter().all(|group| group.len() == 4), "{groups:?}");
        let options = Options { steps: Some(400), ..Options::new(Method::Distill, Budget::BitsPerWeight(3.0)) };
        let learned = method.quantize(Rate::BitsPerWeight(3.0), &options, |_| {}).expect("quantized").graph;
        let [before, after] = [&graph, &learned]
            .map(|graph| graph.nodes.iter().flat_map(|node| node.kind.vectors()).cloned().collect::<Vec<Vec<f32>>>());
        for group in &groups {
            assert!(group.iter().all(|&place| after[place] == after[group[0]]), "{group:?}");
            assert_ne!(after[group[0]], before[group[0]], "{group:?}");
        }
    }
}
