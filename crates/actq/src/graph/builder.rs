//! Checked construction of a network: every matrix and every node is checked against the existing ones. Importers call
//! this; their names of values are their own.

use super::nodes::{Graph, Node};
use super::ops::{Concat, NodeKind, Span};
use super::values::{ValueId, WeightMatrix};
use crate::error::{Result, bail, ensure};

impl Graph {
    /// Adds a weight matrix and returns its index.
    pub fn add_matrix(&mut self, matrix: WeightMatrix) -> Result<usize> {
        let WeightMatrix { name, rows, cols, data } = &matrix;
        ensure!(*rows > 0 && *cols > 0, "the matrix {name:?} is empty: {rows} x {cols}");
        ensure!(data.len() == rows * cols, "the matrix {name:?} of {rows} x {cols} has {} values", data.len());
        self.matrices.push(matrix);
        Ok(self.matrices.len() - 1)
    }

    /// Adds a weight matrix that several nodes may share, and returns the index of the first equal one.
    pub fn share_matrix(&mut self, matrix: WeightMatrix) -> Result<usize> {
        let known = self.matrices.iter().position(|known| *known == matrix);
        known.map_or_else(|| self.add_matrix(matrix), Ok)
    }

    /// Concatenates parts of values; a single part that is a whole value is that value.
    pub fn join(&mut self, parts: Vec<(ValueId, Span)>) -> Result<ValueId> {
        if let [(value, span)] = parts[..]
            && span.len == self.len_of(value)
        {
            return Ok(value);
        }
        let (values, spans): (Vec<_>, Vec<_>) = parts.into_iter().unzip();
        self.add(Concat(spans), &values)
    }

    /// Appends a node that reads `inputs`, and returns its output. An operation that does not fit these values or the
    /// matrices is an error.
    pub fn add(&mut self, kind: impl Into<NodeKind>, inputs: &[ValueId]) -> Result<ValueId> {
        let kind = kind.into();
        let known = self.output();
        if let Some(value) = inputs.iter().find(|value| **value > known) {
            bail!("reads the value {value}, but the network has only {known} nodes");
        }
        let lens: Vec<usize> = inputs.iter().map(|&value| self.len_of(value)).collect();
        let len = kind.output_len(&self.matrices, &lens)?;
        self.nodes.push(Node { kind, inputs: inputs.to_vec(), len });
        Ok(self.output())
    }

    /// Inserts a node after `value`; its `readers` then read the new node's output, which is returned. The numbers of
    /// later values rise by one.
    pub fn insert(&mut self, kind: impl Into<NodeKind>, value: ValueId, readers: &[usize]) -> Result<ValueId> {
        let kind = kind.into();
        let len = kind.output_len(&self.matrices, &[self.len_of(value)])?;
        for (n, node) in self.nodes.iter_mut().enumerate() {
            for input in &mut node.inputs {
                if *input > value || (*input == value && readers.contains(&n)) {
                    *input += 1;
                }
            }
        }
        self.nodes.insert(value, Node { kind, inputs: vec![value], len });
        if let Some(denoising) = &mut self.denoising
            && value <= denoising.first
        {
            denoising.first += 1;
        }
        Ok(value + 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::Evaluator;
    use crate::graph::ops::{Add, Balance, Concat, Gru, LayerNorm, Linear, Lstm, Mul, Normalize, RmsNorm, Span};
    use crate::graph::run::tests::iterative;

    fn matrix(name: &str, rows: usize, cols: usize) -> WeightMatrix {
        WeightMatrix { name: name.into(), rows, cols, data: vec![0.5; rows * cols] }
    }

    #[test]
    fn insertion_renumbers_later_values() {
        let graph = iterative();
        let mut more = graph.clone();
        let same = Balance::new(vec![0.0; 3], vec![1.0; 3]);
        assert_eq!(more.insert(same, 0, &graph.readers(0)).expect("it fits"), 1);
        assert_eq!((more.nodes[1].inputs[0], more.readers(0)), (1, vec![0]));
        let first = |graph: &Graph| graph.denoising.as_ref().map_or(0, |denoising| denoising.first);
        assert_eq!(first(&more), first(&graph) + 1);
        let input: Vec<f32> = (0..graph.input_len()).map(|i| 0.3 * i as f32 - 0.5).collect();
        let outputs = [&graph, &more].map(|graph| Evaluator::new(graph).step(&input, &mut |_, _| {}));
        assert_eq!(outputs[0], outputs[1]);
        // After a value that only the steps read, the first step's node stays the same.
        let read = first(&graph) + 1;
        more.clone_from(&graph);
        let same = Balance::new(vec![0.0; 2], vec![1.0; 2]);
        more.insert(same, read, &graph.readers(read)).expect("it fits");
        assert_eq!((first(&more), more.readers(read)), (first(&graph), vec![read]));
        assert_eq!(Evaluator::new(&more).step(&input, &mut |_, _| {}), outputs[0]);
        let error = more.insert(Balance::new(vec![0.0; 9], vec![1.0; 9]), 0, &[]).expect_err("too many").to_string();
        assert_eq!(error, "mean has 9 values, but 3 are needed");
    }

    #[test]
    fn refused_nodes_leave_the_graph_unchanged() {
        let mut graph = Graph::new(4);
        let w = graph.add_matrix(matrix("w", 3, 4)).expect("a matrix");
        let square = graph.add_matrix(matrix("square", 12, 3)).expect("a matrix");
        let y = graph.add(Linear { matrix: w, bias: vec![0.0; 3] }, &[0]).expect("it fits");
        assert_eq!((y, graph.len_of(y)), (1, 3));
        let norm = |n: usize| LayerNorm { weight: vec![1.0; n], bias: vec![0.0; n], eps: 1e-5 };
        let lstm = |hidden: usize| Lstm { hidden, input: w, state: square, bias: vec![0.0; 4 * hidden] };
        let gru = Gru { hidden: 1, input: w, state: square, input_bias: vec![0.0; 3], state_bias: vec![0.0; 3] };
        let normalize = Normalize { mean: vec![0.0; 4], scale: vec![1.0; 3], pre_clip: 1.0, clip: 1.0 };
        let cases: Vec<(NodeKind, Vec<ValueId>, &str)> = vec![
            (
                Linear { matrix: w, bias: vec![0.0; 3] }.into(),
                vec![y],
                "the matrix \"w\" takes 4 values, but its operand has 3",
            ),
            (Linear { matrix: w, bias: vec![0.0; 2] }.into(), vec![0], "bias has 2 values, but 3 are needed"),
            (Linear { matrix: 7, bias: vec![] }.into(), vec![0], "the network has no matrix 7"),
            (Add.into(), vec![y, 0], "adds 4 values to 3"),
            (Add.into(), vec![y], "takes two inputs, not 1"),
            (Mul.into(), vec![y, 0], "multiplies 3 values with 4"),
            (norm(4).into(), vec![y], "weight has 4 values, but 3 are needed"),
            (norm(3).into(), vec![y, y], "takes one input, not 2"),
            (RmsNorm { weight: vec![1.0], eps: 1e-5 }.into(), vec![0], "weight has 1 values, but 4 are needed"),
            (Concat(vec![Span { from: 2, len: 2 }]).into(), vec![y], "2:4 reaches beyond the input's 3 values"),
            (Concat(vec![Span { from: 0, len: 1 }]).into(), vec![y, 0], "it has 1 parts for 2 inputs"),
            (lstm(2).into(), vec![0], "the matrix \"w\" gives 3 values, but 8 are needed"),
            (gru.into(), vec![0], "the matrix \"square\" takes 3 values, but its operand has 1"),
            (normalize.into(), vec![0], "scale has 3 values, but 4 are needed"),
            (norm(3).into(), vec![9], "reads the value 9, but the network has only 1 nodes"),
        ];
        for (kind, inputs, expected) in cases {
            let error = graph.add(kind, &inputs).expect_err(expected).to_string();
            assert_eq!(error, expected);
        }
        assert_eq!((graph.nodes.len(), graph.matrices.len()), (1, 2));
        let error =
            graph.add_matrix(WeightMatrix { data: vec![0.0; 5], ..matrix("short", 2, 3) }).expect_err("too short");
        assert_eq!(error.to_string(), "the matrix \"short\" of 2 x 3 has 5 values");
        // An equal matrix is shared; a different one of the same name is not.
        let [known, other] = [matrix("square", 12, 3), WeightMatrix { data: vec![7.0; 36], ..matrix("square", 12, 3) }];
        assert_eq!(graph.share_matrix(known).expect("fits"), 1);
        assert_eq!(graph.share_matrix(other).expect("fits"), 2);
    }
}
