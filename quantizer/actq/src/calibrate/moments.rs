//! Second moments of the matrices' inputs over the recorded observations.

use nalgebra::DMatrix;

use crate::data::Dataset;
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
}

/// Input vectors that are collected before they are multiplied together.
const BATCH: usize = 256;

/// Runs the f32 network over `dataset` and returns the moments of every matrix's input. `progress` is called after each
/// episode with the number of frames done.
pub fn collect(graph: &Graph, dataset: &Dataset, progress: &mut dyn FnMut(usize)) -> Vec<Moments> {
    let mut sums: Vec<_> = graph
        .matrices
        .iter()
        .map(|m| {
            (Moments { second: DMatrix::zeros(m.cols, m.cols), mean: vec![0.0; m.cols], count: 0 }, Vec::<f64>::new())
        })
        .collect();
    let mut evaluator = Evaluator::new(graph);
    let mut frames = 0;
    for episode in 0..dataset.length.len() {
        evaluator.start(dataset.start(episode).as_deref());
        for obs in dataset.episode(episode) {
            evaluator.step(&obs, &mut |m, x| {
                let (moments, batch) = &mut sums[m];
                batch.extend(x.iter().map(|&v| f64::from(v)));
                if batch.len() >= BATCH * x.len() {
                    flush(moments, batch);
                }
            });
            frames += 1;
        }
        progress(frames);
    }
    sums.into_iter()
        .map(|(mut moments, mut batch)| {
            flush(&mut moments, &mut batch);
            let count = moments.count.max(1) as f64;
            moments.second /= count;
            moments.mean.iter_mut().for_each(|m| *m /= count);
            moments
        })
        .collect()
}

fn flush(moments: &mut Moments, batch: &mut Vec<f64>) {
    let cols = moments.second.nrows();
    let x = DMatrix::from_column_slice(cols, batch.len() / cols, batch);
    moments.second.gemm(1.0, &x, &x.transpose(), 1.0);
    moments.mean.iter_mut().zip(x.row_iter()).for_each(|(m, x)| *m += x.sum());
    moments.count += x.ncols();
    batch.clear();
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
