//! How much an error of a weight moves the actions: second moments on both sides of every matrix.
//!
//! To second order an error `E` of a matrix adds `tr(E H E' G)` to the squared action error, where `H = E[x x']` is the moment
//! of its input and `G = E[g g']` that of the action error's derivative at its output (Gauss-Newton). `G` is taken by running
//! random signs back through the network, each output divided by its standard deviation: over the signs, the expectation of
//! `g g'` is the sum over the outputs.

use nalgebra::DMatrix;
use ndarray::Array2;

use super::allowance::Allowance;
use super::windows::Windows;
use crate::graph::{Network, zero_state};
use crate::random::Random;

/// Batches that `G` is averaged over, and samples in each.
const BATCHES: usize = 24;
const SAMPLES: usize = 128;
/// Batches at least, however little time there is.
const LEAST_BATCHES: usize = 2;
/// Added to a moment's diagonal, as a share of its mean.
pub const DAMPING_INPUT: f64 = 0.01;
const DAMPING_OUTPUT: f64 = 0.02;

/// `G` of every matrix, `rows * rows`, and how many frames or windows it was taken of: with an allowance, those that fit.
pub fn output_moments(windows: &Windows<'_>, allowance: Option<Allowance>, seed: u64) -> (Vec<DMatrix<f64>>, usize) {
    let graph = windows.graph;
    let network = Network::new(graph);
    let mut random = Random::new(seed);
    let mut sums: Vec<Array2<f32>> = graph.matrices.iter().map(|m| Array2::zeros((m.rows, m.rows))).collect();
    let mut counts = vec![0usize; sums.len()];
    let mut grads = windows.weights.zeros_like();
    let samples = (SAMPLES / windows.window.min(16)).max(4);
    let mut one = || {
        let batch = windows.batch(samples, None, &mut random);
        let mut state = batch.state;
        let pass = network.forward(&windows.weights, batch.frames, &mut state);
        let probe = Array2::from_shape_fn(pass.output().raw_dim(), |(_, d)| {
            let variance = windows.output_variance[d];
            if variance > 0.0 { random.sign() / variance.sqrt() } else { 0.0 }
        });
        let mut d_state = zero_state(graph, samples);
        network.backward(&windows.weights, &pass, probe, &mut d_state, &mut grads, &mut |m, _, dy| {
            ndarray::linalg::general_mat_mul(1.0, &dy.t(), dy, 1.0, &mut sums[m]);
            counts[m] += dy.nrows();
        });
    };
    let batches = match allowance {
        Some(allowance) => allowance.fits(1, &mut one, LEAST_BATCHES, BATCHES),
        None => BATCHES,
    };
    let done = usize::from(allowance.is_some());
    (done..batches).for_each(|_| one());
    let mean = |(sum, count): (Array2<f32>, usize)| {
        DMatrix::from_fn(sum.nrows(), sum.ncols(), |r, c| f64::from(sum[[r, c]]) / count.max(1) as f64)
    };
    (sums.into_iter().zip(counts).map(mean).collect(), batches * samples)
}

/// Which side of a matrix a moment belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// `H`
    Input,
    /// `G`
    Output,
}

/// The weight that each row or column has in the action error: the geometric mean of the moment's diagonal, which an error
/// costs that nothing compensates, and of its conditional diagonal, which remains where those after it (in order of falling
/// diagonal) compensate as far as they can.
pub fn importance(second: &DMatrix<f64>, side: Side) -> Vec<f64> {
    let (order, damped) = damped(second, side);
    let mut importance = vec![0.0; order.len()];
    for (i, &at) in order.iter().enumerate() {
        importance[at] = damped[(i, i)];
    }
    if let Some(factor) = damped.cholesky() {
        let l = factor.l_dirty();
        for (i, &at) in order.iter().enumerate() {
            importance[at] = (importance[at] * l[(i, i)].powi(2)).sqrt();
        }
    }
    importance
}

/// A moment with its rows and columns in order of rising diagonal, and a share of the mean diagonal added to it; and the order.
/// The triangular factor's diagonal is then conditioned on those that come after, which are the largest.
pub fn damped(second: &DMatrix<f64>, side: Side) -> (Vec<usize>, DMatrix<f64>) {
    let n = second.nrows();
    let share = match side {
        Side::Input => DAMPING_INPUT,
        Side::Output => DAMPING_OUTPUT,
    };
    let damping = (share * second.trace() / n as f64).max(1e-30);
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| second[(a, a)].total_cmp(&second[(b, b)]));
    let damped = DMatrix::from_fn(n, n, |i, j| second[(order[i], order[j])] + if i == j { damping } else { 0.0 });
    (order, damped)
}
