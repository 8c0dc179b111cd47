//! The parts of a network that change while it learns or runs: weights and recurrent state.

use ndarray::Array2;
use rayon::prelude::*;

use super::nodes::Graph;
use super::operation::NodeState;
use super::values::WeightMatrix;

/// All learnable values: the matrices of a graph and the vectors of its nodes. Gradients have the same form.
#[derive(Clone, Debug)]
pub struct Weights {
    /// Matrices as in [`Graph::matrices`], `[rows, cols]`.
    pub matrices: Vec<Array2<f32>>,
    /// [`super::operation::Operation::vectors`] of each node.
    pub vectors: Vec<Vec<Vec<f32>>>,
}

impl Weights {
    /// Copies the weights of a graph.
    pub fn of(graph: &Graph) -> Self {
        let array = |m: &WeightMatrix| Array2::from_shape_fn((m.rows, m.cols), |(r, c)| m.data[r * m.cols + c]);
        Self {
            matrices: graph.matrices.iter().map(array).collect(),
            vectors: graph.nodes.iter().map(|n| n.kind.vectors().into_iter().cloned().collect()).collect(),
        }
    }

    /// Returns zeros of the same form.
    pub fn zeros_like(&self) -> Self {
        let zeros = |vectors: &Vec<Vec<f32>>| vectors.iter().map(|v| vec![0.0; v.len()]).collect();
        Self {
            matrices: self.matrices.iter().map(|m| Array2::zeros(m.raw_dim())).collect(),
            vectors: self.vectors.iter().map(zeros).collect(),
        }
    }

    /// Adds another set, element by element.
    pub fn sum(mut self, other: Self) -> Self {
        for (a, b) in self.matrices.iter_mut().zip(&other.matrices) {
            let (a, b) = (a.as_slice_mut().unwrap_or_default(), b.as_slice().unwrap_or_default());
            a.par_chunks_mut(CHUNK).zip(b.par_chunks(CHUNK)).for_each(|(a, b)| add(a, b));
        }
        self.vectors.iter_mut().flatten().zip(other.vectors.iter().flatten()).for_each(|(a, b)| add(a, b));
        self
    }

    /// Stores the vectors in a graph's nodes.
    pub fn store_vectors(&self, graph: &mut Graph) {
        for (node, vectors) in graph.nodes.iter_mut().zip(&self.vectors) {
            node.kind.vectors_mut().into_iter().zip(vectors).for_each(|(to, from)| to.clone_from(from));
        }
    }
}

/// Elements that a thread adds at one time.
const CHUNK: usize = 1 << 14;

fn add(to: &mut [f32], from: &[f32]) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to += from);
}

/// Recurrent state of every node.
pub type State = Vec<NodeState>;

/// Returns the zero state of a batch.
pub fn zero_state(graph: &Graph, batch: usize) -> State {
    graph.nodes.iter().map(|n| n.kind.state_lens().map(|len| Array2::zeros((batch, len)))).collect()
}

/// Returns a batch's state from every sample's values in the order of [`Graph::state_len`]; `None`: zero.
pub fn start_state(graph: &Graph, starts: &[Option<Vec<f32>>]) -> State {
    let mut state = zero_state(graph, starts.len());
    for (sample, start) in starts.iter().enumerate() {
        let mut values = start.iter().flatten();
        for array in state.iter_mut().flatten() {
            array.row_mut(sample).iter_mut().zip(values.by_ref()).for_each(|(to, from)| *to = *from);
        }
    }
    state
}
