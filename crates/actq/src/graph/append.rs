//! Networks made of others.

use super::nodes::Graph;
use super::values::ValueId;
use crate::error::{Result, ensure};

impl Graph {
    /// Appends the nodes of `other`, whose observation is the value `input`; returns the value of its output. Equal
    /// matrices are shared, and so are equal nodes with equal inputs.
    ///
    /// # Errors
    ///
    /// If the lengths do not fit, or `other` has denoising steps.
    pub fn append(&mut self, other: &Self, input: ValueId) -> Result<ValueId> {
        ensure!(other.denoising.is_none(), "a network with denoising steps cannot be joined with others");
        let len = self.len_of(input);
        ensure!(len == other.obs_len, "the network takes {} values, not {len}", other.obs_len);
        let mut matrices = Vec::new();
        for matrix in &other.matrices {
            matrices.push(self.share_matrix(matrix.clone())?);
        }
        let mut values = vec![input];
        for node in &other.nodes {
            let mut kind = node.kind.clone();
            kind.matrices_mut().into_iter().for_each(|matrix| *matrix = matrices[*matrix]);
            let inputs: Vec<ValueId> = node.inputs.iter().map(|value| values[*value]).collect();
            let known = self.nodes.iter().position(|known| known.inputs == inputs && known.kind == kind);
            values.push(match known {
                Some(node) => node + 1,
                None => self.add(kind, &inputs)?,
            });
        }
        Ok(values[other.nodes.len()])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::Evaluator;
    use crate::graph::ops::{Linear, Span};
    use crate::graph::values::WeightMatrix;

    fn linear(name: &str, rows: usize, cols: usize) -> Graph {
        let mut graph = Graph::new(cols);
        let data = (0..rows * cols).map(|i| 0.1 * i as f32).collect();
        let matrix = graph.add_matrix(WeightMatrix { name: name.into(), rows, cols, data }).expect("a matrix");
        graph.add(Linear { matrix, bias: vec![0.5; rows] }, &[0]).expect("it fits");
        graph
    }

    #[test]
    fn joined_networks_compute_what_each_computes() {
        let (first, second) = (linear("a", 2, 3), linear("b", 2, 4));
        let mut both = Graph::new(5);
        let of_first = both.join(vec![(0, Span { from: 0, len: 3 })]).expect("it fits");
        let a = both.append(&first, of_first).expect("it fits");
        let of_second = both.join(vec![(a, Span { from: 0, len: 2 }), (0, Span { from: 3, len: 2 })]).expect("it fits");
        let b = both.append(&second, of_second).expect("it fits");
        assert_eq!(b, both.output());
        let step = |graph: &Graph, input: &[f32]| Evaluator::new(graph).step(input, &mut |_, _| {});
        let middle = step(&first, &[1.0, -2.0, 3.0]);
        let expected = step(&second, &[middle[0], middle[1], 0.25, 4.0]);
        assert_eq!(step(&both, &[1.0, -2.0, 3.0, 0.25, 4.0]), expected);
        // The same network again adds nothing.
        let nodes = both.nodes.len();
        assert_eq!(both.append(&second, of_second).expect("it fits"), b);
        assert_eq!((both.nodes.len(), both.matrices.len()), (nodes, 2));
        let error = both.append(&second, 0).expect_err("too long").to_string();
        assert_eq!(error, "the network takes 4 values, not 5");
    }
}
