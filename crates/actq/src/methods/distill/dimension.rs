//! Hidden vectors whose elements may be permuted, and folded into biases if they are constant. One matrix makes such a
//! vector, and it reaches only matrices, through elementwise functions.

use actq_kernels::Width;
use actq_kernels::math::Function;

use crate::graph::operation::{Operand, Product};
use crate::graph::ops::Pointwise;
use crate::graph::{Graph, NodeKind};

/// Width of every row per matrix; `None` for rows without bits.
pub type Widths = Vec<Vec<Option<Width>>>;

/// A hidden vector that may be permuted and pruned. Numbers are indices of the graph's matrices.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Dimension {
    /// Matrix whose rows make it.
    pub maker: usize,
    /// Matrices whose columns it feeds.
    pub consumers: Vec<usize>,
    /// Linear node that makes it.
    pub node: usize,
}

impl Dimension {
    /// Returns the dimension that feeds matrix `m`.
    pub fn feeding(dimensions: &[Self], m: usize) -> Option<&Self> {
        dimensions.iter().find(|d| d.consumers.contains(&m))
    }

    /// Returns the dimension that matrix `m` makes.
    pub fn made_by(dimensions: &[Self], m: usize) -> Option<&Self> {
        dimensions.iter().find(|d| d.maker == m)
    }

    /// Returns the functions that every element passes.
    pub fn functions(&self, graph: &Graph) -> Vec<Function> {
        let function = |node: usize| match graph.nodes[node].kind {
            NodeKind::Pointwise(Pointwise(function)) => Some(function),
            _ => None,
        };
        elementwise(graph, self.node).unwrap_or_default().into_iter().filter_map(function).collect()
    }

    /// Returns how many of its elements have bits.
    pub fn kept(&self, widths: &Widths) -> usize {
        widths[self.maker].iter().flatten().count()
    }

    /// Returns the kept elements, narrow to wide.
    pub fn order(&self, widths: &Widths) -> Vec<usize> {
        let of = |width: Width| (0..widths[self.maker].len()).filter(move |&r| widths[self.maker][r] == Some(width));
        Width::ALL.into_iter().flat_map(of).collect()
    }
}

/// Finds the dimensions of a graph.
pub fn dimensions(graph: &Graph) -> Vec<Dimension> {
    let linear = |n: usize| match &graph.nodes[n].kind {
        NodeKind::Linear(linear) if uses(graph, linear.matrix) == 1 => Some(linear.matrix),
        _ => None,
    };
    (0..graph.nodes.len())
        .filter_map(|node| {
            let maker = linear(node)?;
            let value = elementwise(graph, node)?.last().map_or(node, |last| *last) + 1;
            let readers = graph.readers(value).into_iter();
            let consumers = readers.map(|reader| consumers(graph, reader)).collect::<Option<Vec<_>>>()?.concat();
            (!consumers.is_empty()).then_some(Dimension { maker, consumers, node })
        })
        .collect()
}

/// Returns the functions that a node's output passes before anything else reads it; `None` if it becomes the network's
/// output.
pub(super) fn elementwise(graph: &Graph, node: usize) -> Option<Vec<usize>> {
    let mut functions = Vec::new();
    let mut value = node + 1;
    while value != graph.output() {
        match graph.readers(value)[..] {
            [next] if matches!(graph.nodes[next].kind, NodeKind::Pointwise(_)) => {
                functions.push(next);
                value = next + 1;
            }
            _ => return Some(functions),
        }
    }
    None
}

/// Returns how many nodes use a matrix.
pub(super) fn uses(graph: &Graph, matrix: usize) -> usize {
    graph.nodes.iter().filter(|node| node.kind.products().iter().any(|p| p.matrix == matrix)).count()
}

/// Returns the matrices through which a node reads its input, if it reads it in no other way and no other node uses
/// them.
pub(super) fn consumers(graph: &Graph, node: usize) -> Option<Vec<usize>> {
    let of_input = |product: &Product| product.operand == Operand::Input;
    let products = graph.nodes[node].kind.products().into_iter().filter(of_input);
    let matrices: Vec<usize> = products.map(|product| product.matrix).collect();
    let alone = !matrices.is_empty() && matrices.iter().all(|&m| uses(graph, m) == 1);
    alone.then_some(matrices)
}

#[cfg(test)]
pub(super) mod testing {
    use super::*;
    use crate::graph::WeightMatrix;
    use crate::graph::ops::{Add, Linear};

    /// Makes a network 3 -> 5 tanh -> [2 and, through a residual sum, 5] with different values everywhere.
    pub(in crate::methods::distill) fn graph() -> Graph {
        let mut graph = Graph::new(3);
        let mut matrix = |rows: usize, cols: usize| {
            let data = (0..rows * cols).map(|i| ((i * 7 + rows) as f32 * 0.37).sin()).collect();
            graph.matrices.push(WeightMatrix { name: "m".into(), rows, cols, data });
        };
        matrix(5, 3);
        matrix(4, 5);
        matrix(4, 4);
        let bias = |n: usize| (0..n).map(|i| 0.1 * i as f32 - 0.2).collect();
        let mut push = |kind: NodeKind, inputs: &[usize]| graph.add(kind, inputs).expect("it fits");
        push(Linear { matrix: 0, bias: bias(5) }.into(), &[0]);
        push(Pointwise(Function::Tanh).into(), &[1]);
        push(Linear { matrix: 1, bias: bias(4) }.into(), &[2]);
        push(Linear { matrix: 2, bias: bias(4) }.into(), &[3]);
        push(Add.into(), &[4, 3]);
        graph
    }
}

#[cfg(test)]
mod tests {
    use super::testing::graph;
    use super::*;

    #[test]
    fn dimensions_feed_only_matrices() {
        // The second matrix's output is also summed, the third's is the network's output.
        let expected = Dimension { maker: 0, consumers: vec![1], node: 0 };
        assert_eq!(dimensions(&graph()), vec![expected]);
    }
}
