//! Hidden vectors whose elements may be permuted, and folded into biases if they are constant. One matrix makes such a
//! vector, for every token that it is applied to, and it reaches only matrices, through elementwise functions.

use std::collections::BTreeMap;

use actq_kernels::Width;
use actq_kernels::math::Function;

use crate::graph::operation::{Operand, Product};
use crate::graph::ops::Pointwise;
use crate::graph::ties::Ties;
use crate::graph::{Graph, NodeKind, ValueId};

/// Width of every row per matrix; `None` for rows without bits.
pub type Widths = Vec<Vec<Option<Width>>>;

/// A hidden vector that may be permuted and pruned. Numbers are indices of the graph's matrices.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Dimension {
    /// Matrix whose rows make it.
    pub maker: usize,
    /// Matrices whose columns it feeds.
    pub consumers: Vec<usize>,
    /// Functions that every element passes.
    pub functions: Vec<Function>,
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
    let ties = Ties::of(graph);
    let has = |value: ValueId, group: usize| ties.values[value].contains(&group);
    let mut nodes: BTreeMap<usize, Vec<usize>> = ties.free.iter().map(|&group| (group, Vec::new())).collect();
    for (n, node) in graph.nodes.iter().enumerate() {
        let mut groups: Vec<usize> =
            node.inputs.iter().chain([&(n + 1)]).flat_map(|v| ties.values[*v].clone()).collect();
        groups.sort_unstable();
        groups.dedup();
        for group in groups {
            nodes.entry(group).and_modify(|nodes| nodes.push(n));
        }
    }
    let of_group = |(&group, nodes): (&usize, &Vec<usize>)| {
        let mut maker = None;
        let (mut read, mut functions): (Vec<usize>, Option<Vec<Function>>) = (Vec::new(), None);
        // Functions that the vector has passed, as each value holds it.
        let mut passed = BTreeMap::<ValueId, Vec<Function>>::new();
        for &n in nodes {
            let node = &graph.nodes[n];
            let mut before = node.inputs.iter().filter_map(|value| passed.get(value));
            let first = before.next().cloned();
            let is_one = before.all(|other| Some(other) == first.as_ref());
            match (&node.kind, first) {
                (NodeKind::Pointwise(Pointwise(function)), Some(mut before)) => {
                    before.push(*function);
                    passed.insert(n + 1, before);
                }
                (NodeKind::Concat(_), Some(before)) if is_one => {
                    if has(n + 1, group) {
                        passed.insert(n + 1, before);
                    }
                }
                (NodeKind::Linear(linear), None) if maker.is_none_or(|maker| maker == linear.matrix) => {
                    maker = Some(linear.matrix);
                    passed.insert(n + 1, Vec::new());
                }
                (_, Some(before)) if !has(n + 1, group) && *functions.get_or_insert(before.clone()) == before => {
                    read.extend(consumers(graph, n)?);
                }
                _ => return None,
            }
        }
        let maker = maker.filter(|&maker| ties.rows[maker] == (1, vec![group]))?;
        read.sort_unstable();
        read.dedup();
        let is_all = read.iter().all(|&m| ties.cols[m] == [group]);
        functions.filter(|_| is_all).map(|functions| Dimension { maker, consumers: read, functions })
    };
    nodes.iter().filter_map(of_group).collect()
}

/// Returns the matrices through which a node reads its input, if it reads it in no other way.
fn consumers(graph: &Graph, node: usize) -> Option<Vec<usize>> {
    let of_input = |product: &Product| product.operand == Operand::Input;
    let products = graph.nodes[node].kind.products().into_iter().filter(of_input);
    let matrices: Vec<usize> = products.map(|product| product.matrix).collect();
    (!matrices.is_empty()).then_some(matrices)
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
    use crate::testing::transformer;

    #[test]
    fn dimensions_feed_only_matrices() {
        // The second matrix's output is also summed, the third's is the network's output.
        let expected = Dimension { maker: 0, consumers: vec![1], functions: vec![Function::Tanh] };
        assert_eq!(dimensions(&graph()), vec![expected]);
    }

    #[test]
    fn layers_of_several_tokens_have_dimensions() {
        for context in [0, 3] {
            let graph = transformer(context);
            let of =
                |Dimension { maker, consumers, functions }| (graph.matrices[maker].rows, consumers.len(), functions);
            let found: Vec<_> = dimensions(&graph).into_iter().map(of).collect();
            assert_eq!(found, vec![(32, 1, vec![Function::Gelu]); 2], "context {context}");
        }
    }
}
