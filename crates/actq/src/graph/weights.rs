//! The parts of a network that change while it learns or runs: weights and recurrent state.

use ndarray::Array2;
use rayon::prelude::*;

use super::matrix::{Factors, Matrix};
use super::nodes::Graph;
use super::operation::NodeState;
use crate::gemm::{Panels, Sum, add_products_parallel};

/// Vectors of every node, as [`super::operation::Operation::vectors`], or derivatives by them.
pub type Vectors = Vec<Vec<Vec<f32>>>;

/// All learnable values: the matrices of a graph and the vectors of its nodes.
#[derive(Clone, Debug)]
pub struct Weights {
    /// Matrices as in [`Graph::matrices`].
    pub matrices: Vec<Matrix>,
    /// Vectors of the nodes.
    pub vectors: Vectors,
}

impl Weights {
    /// Copies the weights of a graph.
    pub fn of(graph: &Graph) -> Self {
        Self {
            matrices: graph.matrices.iter().map(Matrix::of).collect(),
            vectors: graph.nodes.iter().map(|n| n.kind.vectors().into_iter().cloned().collect()).collect(),
        }
    }

    /// Returns zeros in the form of the vectors.
    pub(super) fn zero_vectors(&self) -> Vectors {
        let zeros = |vectors: &Vec<Vec<f32>>| vectors.iter().map(|v| vec![0.0; v.len()]).collect();
        self.vectors.iter().map(zeros).collect()
    }

    /// Stores the vectors in a graph's nodes.
    pub fn store_vectors(&self, graph: &mut Graph) {
        for (node, vectors) in graph.nodes.iter_mut().zip(&self.vectors) {
            node.kind.vectors_mut().into_iter().zip(vectors).for_each(|(to, from)| to.clone_from(from));
        }
    }
}

/// Derivatives of a loss by all weights.
#[derive(Debug)]
pub struct Derivatives {
    /// Factors of those by the matrices, one for every product.
    pub products: Vec<Factors>,
    /// Derivatives by the vectors.
    pub vectors: Vectors,
}

impl Derivatives {
    /// Returns the sums of several derivatives: those by the matrices `[row, column]`, and those by the vectors.
    pub fn sum(graph: &Graph, all: Vec<Self>) -> (Vec<Array2<f32>>, Vectors) {
        let factors: Vec<&Factors> = all.iter().flat_map(|d| &d.products).collect();
        let panels: Vec<Panels> = factors.par_iter().map(|factors| Panels::of(factors.x.view())).collect();
        let mut matrices: Vec<Array2<f32>> =
            graph.matrices.iter().map(|matrix| Array2::zeros((matrix.rows, matrix.cols))).collect();
        let mut sums: Vec<Sum<'_, f32>> = matrices.iter_mut().map(|sum| (Vec::new(), sum.view_mut())).collect();
        for (factors, panels) in factors.into_iter().zip(&panels) {
            sums[factors.matrix].0.push((factors.dy.t(), panels));
        }
        add_products_parallel(sums);
        let vectors = all.into_iter().map(|d| d.vectors).reduce(|mut sum, vectors| {
            let pairs = sum.iter_mut().flatten().zip(vectors.iter().flatten());
            pairs.for_each(|(to, from)| to.iter_mut().zip(from).for_each(|(to, from)| *to += from));
            sum
        });
        (matrices, vectors.unwrap_or_default())
    }
}

/// Recurrent state of every node.
pub type State = Vec<NodeState>;

/// Returns the zero state of a batch.
pub fn zero_state(graph: &Graph, batch: usize) -> State {
    graph.nodes.iter().map(|n| n.kind.state_lens().map(|len| Array2::zeros((batch, len)))).collect()
}

/// Copies the values of one sample of a batch's state to a sample of another, where they are as many.
pub fn copy_sample(from: &State, sample: usize, to: &mut State, at: usize) {
    for (from, to) in from.iter().flatten().zip(to.iter_mut().flatten()) {
        if from.ncols() == to.ncols() && from.ncols() > 0 {
            to.row_mut(at).assign(&from.row(sample));
        }
    }
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
