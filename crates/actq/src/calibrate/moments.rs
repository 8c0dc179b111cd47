//! Second moments of the matrices' inputs over the recorded observations.

use nalgebra::DMatrix;
use ndarray::Array2;

use crate::data::Dataset;
use crate::gemm::{Panels, add_product_parallel};
use crate::graph::{Evaluator, Graph, WeightMatrix};

/// Second moment `E[x x']` of a matrix's input, with mean and count.
#[derive(Clone, Debug)]
pub struct Moments {
    /// Second moment, `cols * cols`, symmetric.
    pub second: DMatrix<f64>,
    /// Mean `E[x]`.
    pub mean: Vec<f64>,
    /// Number of input vectors.
    pub count: usize,
}

impl Moments {
    /// Returns `E[(x - E[x]) (x - E[x])']`.
    pub fn centred(&self) -> DMatrix<f64> {
        let mean = nalgebra::DVectorView::from_slice(&self.mean, self.mean.len());
        &self.second - mean * mean.transpose()
    }

    /// Returns whether f32 can hold the squares of all values.
    pub(crate) fn fits_f32(&self) -> bool {
        self.second.diagonal().iter().all(|square| square * self.count as f64 <= f64::from(f32::MAX))
    }

    /// Returns the moments of some elements.
    pub fn of(&self, elements: &[usize]) -> Self {
        Self {
            second: self.second.select_rows(elements).select_columns(elements),
            mean: elements.iter().map(|&element| self.mean[element]).collect(),
            count: self.count,
        }
    }
}

/// Input vectors that are collected before they are multiplied together.
const BATCH: usize = 256;

/// Runs the f32 network over `dataset` and returns the moments of every matrix's input. `progress` is called after each
/// episode with the number of frames done.
pub fn collect(graph: &Graph, dataset: &Dataset, progress: &mut dyn FnMut(usize)) -> Vec<Moments> {
    let mut sums: Vec<_> = graph.matrices.iter().map(|m| Sum::new(m.cols)).collect();
    let mut evaluator = Evaluator::new(graph);
    let mut frames = 0;
    for episode in 0..dataset.length.len() {
        evaluator.start(dataset.start(episode).as_deref());
        for obs in dataset.episode(episode) {
            evaluator.step(&obs, &mut |m, x| {
                sums[m].add(x);
            });
            frames += 1;
        }
        progress(frames);
    }
    sums.into_iter().map(Sum::moments).collect()
}

/// Sums over the inputs of a matrix.
struct Sum {
    second: Array2<f64>,
    first: Vec<f64>,
    count: usize,
    /// Inputs that are not counted yet, one after the other.
    batch: Vec<f64>,
}

impl Sum {
    fn new(cols: usize) -> Self {
        Self { second: Array2::zeros((cols, cols)), first: vec![0.0; cols], count: 0, batch: Vec::new() }
    }

    fn add(&mut self, x: &[f32]) {
        self.batch.extend(x.iter().map(|&v| f64::from(v)));
        if self.batch.len() >= BATCH * x.len() {
            self.flush();
        }
    }

    fn flush(&mut self) {
        let cols = self.first.len();
        let batch = std::mem::take(&mut self.batch);
        self.count += batch.len() / cols;
        let Ok(x) = Array2::from_shape_vec((batch.len() / cols, cols), batch) else { return };
        add_product_parallel(x.t(), &Panels::of(x.view()), self.second.view_mut());
        for row in x.rows() {
            self.first.iter_mut().zip(row).for_each(|(sum, x)| *sum += x);
        }
    }

    fn moments(mut self) -> Moments {
        self.flush();
        let count = self.count.max(1) as f64;
        let cols = self.first.len();
        Moments {
            second: DMatrix::from_fn(cols, cols, |i, j| self.second[[i, j]] / count),
            mean: self.first.iter().map(|sum| sum / count).collect(),
            count: self.count,
        }
    }
}

/// Returns `E |(W' - W) x|^2 / E |W x|^2`, for white inputs without moments; 0 for a matrix whose output is always 0.
pub fn relative_error(matrix: &WeightMatrix, quantized: &[f32], moments: Option<&Moments>) -> f64 {
    let energy = |rows: &[f64]| -> f64 {
        rows.chunks_exact(matrix.cols)
            .map(|row| {
                let row = nalgebra::DVectorView::from_slice(row, row.len());
                moments.map_or_else(|| row.norm_squared(), |m| row.dot(&(&m.second * row)))
            })
            .sum()
    };
    let weights: Vec<f64> = matrix.data.iter().map(|&w| f64::from(w)).collect();
    let errors: Vec<f64> = quantized.iter().zip(&weights).map(|(&q, w)| f64::from(q) - w).collect();
    let signal = energy(&weights);
    if signal > 0.0 { energy(&errors) / signal } else { 0.0 }
}
