//! Evaluation of single frames in f32.

use ndarray::Array2;

use super::arrays::contiguous;
use super::nodes::Graph;
use super::run::Network;
use super::weights::{State, Weights, start_state};

/// Evaluates a graph in f32, step by step, with its recurrent state.
#[derive(Debug)]
pub struct Evaluator<'g> {
    network: Network<'g>,
    weights: Weights,
    state: State,
}

impl<'g> Evaluator<'g> {
    /// Makes an evaluator with the zero state.
    pub fn new(graph: &'g Graph) -> Self {
        let state = start_state(graph, &[None]);
        Self { network: Network::new(graph), weights: Weights::of(graph), state }
    }

    /// Zeroes the recurrent state.
    pub fn reset(&mut self) {
        self.start(None);
    }

    /// Sets the recurrent state, in the order of [`Graph::state_len`]; `None`: zero.
    pub fn start(&mut self, state: Option<&[f32]>) {
        self.state = start_state(self.network.graph, &[state.map(<[f32]>::to_vec)]);
    }

    /// Returns the recurrent state, in the order of [`Graph::state_len`].
    pub fn state(&self) -> Vec<f32> {
        self.state.iter().flatten().flat_map(|array| array.row(0).to_vec()).collect()
    }

    /// Returns the network's output for one observation of the graph's length, with its noise. `tap` receives every
    /// matrix's index and input vector.
    pub fn step(&mut self, obs: &[f32], tap: &mut dyn FnMut(usize, &[f32])) -> Vec<f32> {
        let obs = Array2::from_shape_fn((1, obs.len()), |(_, i)| obs[i]);
        let pass = self.network.forward(&self.weights, obs, &mut self.state);
        for (matrix, operand) in self.network.operands(&pass) {
            operand.rows().into_iter().for_each(|row| tap(matrix, contiguous(&row)));
        }
        pass.output().iter().copied().collect()
    }
}
