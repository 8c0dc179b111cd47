//! Stage 1 of ActQuant: how much each matrix adds to the information of its values about the actions.

use std::collections::BTreeMap;

use actq::data::Dataset;
use actq::error::{Context, Result, ensure};
use actq::graph::{Evaluator, Graph, WeightMatrix};
use ndarray::Array2;

use super::choices::ScoreOf;
use super::hsic::{Bandwidth, Kernel, hsic};

/// Most frames of a kernel. Time and memory grow with the square; this many take 512 MiB per kernel.
pub const MAX_FRAMES: usize = 8192;

/// Weight of the dependence on the network's input (the paper's lambda_x).
const LAMBDA_X: f64 = 1.0;
/// Weight of the dependence on the actions (the paper's lambda_y).
const LAMBDA_Y: f64 = 1.0;

/// Dependences that a matrix's score consists of.
///
/// ActQuant (arXiv 2605.24011) scores values Z by the HSIC bottleneck `F(Z) = -lambda_x HSIC(X, Z) + lambda_y HSIC(Y,
/// Z)`, and a matrix by `sens = F(output) - F(input)`. As in the authors' code, X is the same for every matrix: the
/// input of the network's first one. So `sens` measures how far the matrix moves the values from the observation
/// towards the actions.
#[derive(Clone, Copy, Debug)]
pub struct Score {
    /// HSIC(X, the matrix's input)
    pub x_input: f64,
    /// HSIC(Y, the matrix's input)
    pub y_input: f64,
    /// HSIC(X, the matrix's output)
    pub x_output: f64,
    /// HSIC(Y, the matrix's output)
    pub y_output: f64,
}

impl Score {
    /// Returns `F(input)`.
    pub fn f_input(&self) -> f64 {
        LAMBDA_Y * self.y_input - LAMBDA_X * self.x_input
    }

    /// Returns `F(output)`.
    pub fn f_output(&self) -> f64 {
        LAMBDA_Y * self.y_output - LAMBDA_X * self.x_output
    }

    /// Returns `F(output) - F(input)`.
    pub fn sens(&self) -> f64 {
        self.f_output() - self.f_input()
    }

    /// Returns all figures by name, for files of statistics.
    pub fn figures(&self) -> BTreeMap<String, f64> {
        let Self { x_input, y_input, x_output, y_output } = *self;
        let differences = [("f_input", self.f_input()), ("f_output", self.f_output()), ("sens", self.sens())];
        let terms = [("x_input", x_input), ("y_input", y_input), ("x_output", x_output), ("y_output", y_output)];
        differences.into_iter().chain(terms).map(|(name, figure)| (name.to_owned(), figure)).collect()
    }

    /// Returns the chosen score.
    pub fn of(&self, score: ScoreOf) -> f64 {
        match score {
            ScoreOf::Gain => self.sens(),
            ScoreOf::Output => self.f_output(),
        }
    }
}

/// Returns the scores of all matrices over at most `most` evenly spaced frames of `dataset`, which must hold actions.
///
/// Inputs and outputs have Gaussian kernels, the actions the linear kernel. A matrix that is used several times in a
/// frame is scored by the mean of its inputs and outputs. Biases are ignored, since no kernel depends on them.
pub fn scores(graph: &Graph, dataset: &Dataset, most: usize, bandwidth: Bandwidth) -> Result<Vec<Score>> {
    let frames = dataset.frames();
    let step = frames.div_ceil(most.clamp(1, MAX_FRAMES)).max(1);
    ensure!(frames.div_ceil(step) >= 2, "{}: too few frames; at least 2 frames are needed", dataset.path.display());
    let samples = Samples::collect(graph, dataset, step)?;
    let actions = Kernel::linear(&standardized(&samples.actions));
    let observation = Kernel::gaussian(&samples.inputs[samples.first], bandwidth);
    let score = |(matrix, x): (&WeightMatrix, &Array2<f64>)| {
        let input = Kernel::gaussian(x, bandwidth);
        let weights =
            Array2::from_shape_fn((matrix.cols, matrix.rows), |(c, r)| f64::from(matrix.data[r * matrix.cols + c]));
        let output = Kernel::gaussian(&x.dot(&weights), bandwidth);
        Score {
            x_input: hsic(&observation, &input),
            y_input: hsic(&actions, &input),
            x_output: hsic(&observation, &output),
            y_output: hsic(&actions, &output),
        }
    };
    Ok(graph.matrices.iter().zip(&samples.inputs).map(score).collect())
}

/// Values at every `step`-th frame.
struct Samples {
    /// Inputs per matrix, `[frame, column]`.
    inputs: Vec<Array2<f64>>,
    /// Actions, `[frame, element]`.
    actions: Array2<f64>,
    /// Matrix that is evaluated first.
    first: usize,
}

impl Samples {
    fn collect(graph: &Graph, dataset: &Dataset, step: usize) -> Result<Self> {
        let count = dataset.frames().div_ceil(step);
        let mut inputs: Vec<Array2<f64>> = graph.matrices.iter().map(|m| Array2::zeros((count, m.cols))).collect();
        let mut actions = Array2::zeros((count, graph.len_of(graph.output())));
        let mut first = None;
        let mut evaluator = Evaluator::new(graph);
        let mut frame = 0;
        for episode in 0..dataset.length.len() {
            evaluator.start(dataset.start(episode).as_deref());
            for (at, obs) in dataset.episode(episode).enumerate() {
                let row = (frame % step == 0).then_some(frame / step);
                let mut uses = vec![0.0; graph.matrices.len()];
                evaluator.step(&obs, &mut |m, x| {
                    first.get_or_insert(m);
                    let Some(row) = row else { return };
                    uses[m] += 1.0;
                    inputs[m].row_mut(row).iter_mut().zip(x).for_each(|(sum, &x)| *sum += f64::from(x));
                });
                if let Some(row) = row {
                    for (input, uses) in inputs.iter_mut().zip(uses) {
                        input.row_mut(row).mapv_inplace(|sum| sum / f64::max(uses, 1.0));
                    }
                    let action = dataset.action_at(episode, at).context("array \"action\" is missing")?;
                    actions.row_mut(row).iter_mut().zip(action).for_each(|(to, a)| *to = f64::from(a));
                }
                frame += 1;
            }
        }
        Ok(Self { inputs, actions, first: first.context("the network has no matrices")? })
    }
}

/// Standardizes columns to mean 0 and variance 1, and drops constant columns.
fn standardized(samples: &Array2<f64>) -> Array2<f64> {
    let columns: Vec<Vec<f64>> = samples
        .columns()
        .into_iter()
        .filter_map(|column| {
            let mean = column.mean()?;
            let variance = column.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / column.len() as f64;
            let varies = variance > 1e-12 * (variance + mean * mean);
            varies.then(|| column.iter().map(|v| (v - mean) / variance.sqrt()).collect())
        })
        .collect();
    Array2::from_shape_fn((samples.nrows(), columns.len()), |(row, column)| columns[column][row])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{dataset, lstm};

    #[test]
    fn the_first_matrix_reads_the_observation() {
        let graph = lstm();
        let dataset = dataset(&graph, 3, 20);
        let scores = scores(&graph, &dataset, 512, Bandwidth::Median).expect("scores");
        assert_eq!(scores.len(), graph.matrices.len());
        for score in &scores {
            assert!(score.sens().is_finite());
        }
        let first = scores[0];
        assert!(first.x_input > first.x_output, "nothing depends on X more than X itself: {first:?}");
    }

    #[test]
    fn frames_are_limited() {
        let graph = lstm();
        let dataset = dataset(&graph, 1, 24);
        let score = |most| scores(&graph, &dataset, most, Bandwidth::Median).expect("scores")[0].sens();
        assert_eq!(score(24), score(usize::MAX));
        assert_ne!(score(24), score(8));
        // Fewer than 13, evenly spaced: every second.
        assert_eq!(score(12), score(13));
        let error = scores(&graph, &Dataset { length: vec![1], ..dataset.clone() }, 24, Bandwidth::Median);
        assert!(error.is_err_and(|error| error.to_string().contains("at least 2 frames")));
    }

    #[test]
    fn standardization_drops_constant_columns() {
        let samples = Array2::from_shape_fn((50, 3), |(i, j)| if j == 1 { 0.3 } else { 5.0 + (i * (j + 1)) as f64 });
        let found = standardized(&samples);
        assert_eq!(found.dim(), (50, 2));
        for column in found.columns() {
            assert!(column.sum().abs() < 1e-9);
            assert!((column.dot(&column) / 50.0 - 1.0).abs() < 1e-9);
        }
    }
}
