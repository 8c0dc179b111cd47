//! Sensitivity of the actions to errors of a weight: second moments on both sides of every matrix.
//!
//! To second order, an error `E` of a matrix adds `tr(E H E' G)` to the squared action error (Gauss-Newton). `H = E[x
//! x']` is the moment of its input, and `G = E[g g']` that of the action error's derivative at its output. To estimate
//! `G`, random signs run back through the network, with each output divided by its standard deviation. Over the signs,
//! the expectation of `g g'` is the sum over the outputs.

use nalgebra::DMatrix;
use ndarray::{Array1, Array2, Axis};

use super::allowance::Allowance;
use super::moments::Moments;
use super::windows::Windows;
use crate::gemm::{Panels, add_product_parallel};
use crate::graph::{Factors, Network, zero_state};
use crate::numbers::square;
use crate::random::Random;

/// Batches that `G` is averaged over, and samples in each.
const BATCHES: usize = 24;
const SAMPLES: usize = 128;
/// Least batches, however short the time.
const MIN_BATCHES: usize = 2;
/// Frames of [`drawn_moments`].
const DRAWN: usize = 12_288;
/// Damping of an input's moment: added to its diagonal, as a share of the diagonal's mean.
pub const DAMPING_INPUT: f64 = 0.01;
/// Damping of `G`.
pub const DAMPING_OUTPUT: f64 = 0.02;

/// Returns `G` of every matrix, `rows * rows`, and the number of frames or windows that it was taken over: with an
/// allowance, those that fit.
pub fn output_moments(windows: &Windows, allowance: Option<Allowance>, seed: u64) -> (Vec<DMatrix<f64>>, usize) {
    let graph = &windows.graph;
    let mut random = Random::new(seed);
    let mut sums: Vec<Array2<f32>> = graph.matrices.iter().map(|m| Array2::zeros((m.rows, m.rows))).collect();
    let mut counts = vec![0usize; sums.len()];
    let samples = (SAMPLES / windows.window.min(16)).max(4);
    let mut one = || {
        for Factors { matrix, dy, .. } in probe(windows, samples, &mut random) {
            add_moment(&dy, &mut sums[matrix]);
            counts[matrix] += dy.nrows();
        }
    };
    let batches = match allowance {
        Some(allowance) => allowance.fits(1, &mut one, MIN_BATCHES, BATCHES),
        None => BATCHES,
    };
    let done = usize::from(allowance.is_some());
    (done..batches).for_each(|_| one());
    let mean = |(sum, count): (Array2<f32>, usize)| {
        DMatrix::from_fn(sum.nrows(), sum.ncols(), |r, c| f64::from(sum[[r, c]]) / count.max(1) as f64)
    };
    (sums.into_iter().zip(counts).map(mean).collect(), batches * samples)
}

/// Adds `x' x`.
fn add_moment(x: &Array2<f32>, sum: &mut Array2<f32>) {
    add_product_parallel(x.t(), &Panels::of(x.view()), sum.view_mut());
}

/// Draws `samples` samples, and runs a random sign over the deviation of every output back through the network. Returns
/// the factors at every matrix.
fn probe(windows: &Windows, samples: usize, random: &mut Random) -> Vec<Factors> {
    let network = Network::new(&windows.graph);
    let batch = windows.batch(samples, None, random);
    let mut state = batch.state;
    let pass = network.forward(&windows.weights, batch.frames, &mut state);
    let signs = Array2::from_shape_fn(pass.output().raw_dim(), |(_, d)| {
        let variance = windows.output_variance[d];
        if variance > 0.0 { random.sign() / variance.sqrt() } else { 0.0 }
    });
    let mut d_state = zero_state(&windows.graph, samples);
    network.backward(&windows.weights, pass, signs, &mut d_state).products
}

/// Returns the moments on both sides of every matrix over drawn batches: `E[x x']` with its mean, and `G`. The frames
/// of a batch are summed together, in a fraction of the time that frames take one by one.
pub fn drawn_moments(windows: &Windows, seed: u64) -> Vec<(Moments, DMatrix<f64>)> {
    let graph = &windows.graph;
    let mut random = Random::new(seed);
    let mut sums: Vec<Drawn> = graph.matrices.iter().map(|m| Drawn::zeros(m.rows, m.cols)).collect();
    let samples = (SAMPLES / windows.window).max(4);
    for _ in 0..(DRAWN / (samples * windows.window)).max(BATCHES) {
        for Factors { matrix, x, dy } in probe(windows, samples, &mut random) {
            sums[matrix].add(&x, &dy);
        }
    }
    sums.into_iter().map(Drawn::mean).collect()
}

/// Sums over the inputs of a matrix and the derivatives at its output.
struct Drawn {
    input: Array2<f32>,
    inputs: Array1<f32>,
    output: Array2<f32>,
    count: usize,
}

impl Drawn {
    fn zeros(rows: usize, cols: usize) -> Self {
        Self {
            input: Array2::zeros((cols, cols)),
            inputs: Array1::zeros(cols),
            output: Array2::zeros((rows, rows)),
            count: 0,
        }
    }

    fn add(&mut self, x: &Array2<f32>, dy: &Array2<f32>) {
        add_moment(x, &mut self.input);
        add_moment(dy, &mut self.output);
        self.inputs += &x.sum_axis(Axis(0));
        self.count += x.nrows();
    }

    fn mean(self) -> (Moments, DMatrix<f64>) {
        let count = self.count.max(1) as f64;
        let of = |sum: &Array2<f32>| DMatrix::from_fn(sum.nrows(), sum.ncols(), |r, c| f64::from(sum[[r, c]]) / count);
        let mean = self.inputs.iter().map(|sum| f64::from(*sum) / count).collect();
        (Moments { second: of(&self.input), mean, count: self.count }, of(&self.output))
    }
}

/// Side of a matrix that a moment belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The input: `H`.
    Input,
    /// The output: `G`.
    Output,
}

/// Returns the weight of each row or column in the action error. It is the geometric mean of the moment's diagonal and
/// its conditional diagonal. The diagonal is the cost of an uncompensated error. The conditional diagonal is the cost
/// that remains if later rows or columns (in order of falling diagonal) compensate as far as they can.
pub fn importance(second: &DMatrix<f64>, side: Side) -> Vec<f64> {
    let damping = match side {
        Side::Input => DAMPING_INPUT,
        Side::Output => DAMPING_OUTPUT,
    };
    let (order, damped) = damped(second, damping);
    let mut importance = vec![0.0; order.len()];
    for (i, &at) in order.iter().enumerate() {
        importance[at] = damped[(i, i)];
    }
    if let Some(factor) = damped.cholesky() {
        let l = factor.l_dirty();
        for (i, &at) in order.iter().enumerate() {
            importance[at] = (importance[at] * square(l[(i, i)])).sqrt();
        }
    }
    importance
}

/// Returns the order of rising diagonal, and the moment in that order with a share of the mean diagonal added to its
/// diagonal. The triangular factor's diagonal is then conditioned on the later elements, which are the largest.
pub fn damped(second: &DMatrix<f64>, share: f64) -> (Vec<usize>, DMatrix<f64>) {
    let n = second.nrows();
    let damping = (share * second.trace() / n as f64).max(1e-30);
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| second[(a, a)].total_cmp(&second[(b, b)]));
    let damped = DMatrix::from_fn(n, n, |i, j| second[(order[i], order[j])] + if i == j { damping } else { 0.0 });
    (order, damped)
}
