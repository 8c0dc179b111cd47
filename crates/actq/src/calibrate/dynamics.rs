//! A linear model of the robot, fitted to a recording: the next observation from an observation and the policy's
//! answer to it, by ridge regression.

use nalgebra::DMatrix;
use ndarray::{Array1, Array2, ArrayView2, Axis, s};

use crate::data::mean_and_variance;
use crate::gemm::{Panels, add_product_parallel};

/// Ridge: added to the diagonal of the moments, in units of the values' variances.
const RIDGE: f64 = 1e-3;
/// One episode in this many is left out to measure the model.
const LEFT_OUT: usize = 4;

/// The model, for values in units of their deviations.
#[derive(Debug)]
pub(super) struct Dynamics {
    /// Deviation of each observation value and of each answer value; 0 for one that does not change.
    pub(super) observation: Vec<f32>,
    pub(super) answer: Vec<f32>,
    /// `[observation and answer, next observation]`
    matrix: Panels,
    /// Residuals of the recorded steps, `[step, value]`.
    pub(super) residuals: Array2<f32>,
    /// Share of the next observation's variance that it predicts in episodes that it was not fitted to, mean over the
    /// values; 0 with fewer than two steps to measure.
    pub(super) predicted: f64,
}

/// Steps of an episode: observations with the answers to them, and the observations after them.
#[derive(Clone, Copy)]
struct Steps<'a> {
    before: ArrayView2<'a, f64>,
    after: ArrayView2<'a, f64>,
}

impl Dynamics {
    /// Fits the model to episodes of observations and answers, `[step, value]`; `None` where nothing changes.
    pub(super) fn fit(episodes: &[Array2<f32>], answers: &[Array2<f32>]) -> Option<Self> {
        let (of_observation, of_answer) = (Units::of(episodes), Units::of(answers));
        let steps = |(episode, answers): (&Array2<f32>, &Array2<f32>)| {
            let (last, values) = (episode.nrows().saturating_sub(1), episode.ncols());
            let observed = of_observation.of_rows(episode.view());
            let mut before = Array2::zeros((last, values + answers.ncols()));
            before.slice_mut(s![.., ..values]).assign(&observed.slice(s![..last, ..]));
            before.slice_mut(s![.., values..]).assign(&of_answer.of_rows(answers.slice(s![..last, ..])));
            (before, observed.slice(s![1.min(episode.nrows()).., ..]).to_owned())
        };
        let arrays: Vec<(Array2<f64>, Array2<f64>)> = episodes.iter().zip(answers).map(steps).collect();
        let all: Vec<Steps<'_>> =
            arrays.iter().map(|(before, after)| Steps { before: before.view(), after: after.view() }).collect();
        let matrix = regression(&all)?;
        let residuals: Vec<Array2<f64>> = all.iter().map(|steps| steps.residuals(&matrix)).collect();
        let rows = residuals.iter().flat_map(|residuals| residuals.iter().map(|value| *value as f32)).collect();
        let count = residuals.iter().map(Array2::nrows).sum();
        Some(Self {
            residuals: Array2::from_shape_vec((count, of_observation.deviation.len()), rows).ok()?,
            predicted: predicted(&all).unwrap_or(0.0),
            observation: of_observation.deviation.iter().map(|value| *value as f32).collect(),
            answer: of_answer.deviation.iter().map(|value| *value as f32).collect(),
            matrix: Panels::of(matrix.mapv(|value| value as f32).view()),
        })
    }

    /// Returns the next differences of observations, `[sample, value]`, for differences of observations and answers,
    /// all in deviations.
    pub(super) fn next(&self, differences: ArrayView2<'_, f32>) -> Array2<f32> {
        let mut next = Array2::zeros((differences.nrows(), self.observation.len()));
        add_product_parallel(differences, &self.matrix, next.view_mut());
        next
    }
}

/// Fits to three in four episodes and measures the share of variance that is predicted in the others; with fewer than
/// four episodes, to the first three quarters of each.
fn predicted(all: &[Steps<'_>]) -> Option<f64> {
    // Steps of an episode that are fitted to.
    let fitted_of = |index: usize, steps: &Steps<'_>| match steps.before.nrows() {
        count if all.len() < LEFT_OUT => count * (LEFT_OUT - 1) / LEFT_OUT,
        _ if index % LEFT_OUT == LEFT_OUT - 1 => 0,
        count => count,
    };
    let (fitted, measured): (Vec<_>, Vec<_>) =
        all.iter().enumerate().map(|(index, steps)| steps.split_at(fitted_of(index, steps))).unzip();
    let matrix = regression(&fitted)?;
    let squares =
        |rows: ArrayView2<'_, f64>| rows.map_axis(Axis(0), |column| column.iter().map(|v| v * v).sum::<f64>());
    let (mut left, mut whole) = (Array1::<f64>::zeros(matrix.ncols()), Array1::<f64>::zeros(matrix.ncols()));
    for steps in &measured {
        left += &squares(steps.residuals(&matrix).view());
        whole += &squares(steps.after);
    }
    let shares: Vec<f64> = left.iter().zip(&whole).filter(|(_, w)| **w > 0.0).map(|(l, w)| 1.0 - l / w).collect();
    (!shares.is_empty()).then(|| shares.iter().sum::<f64>() / shares.len() as f64)
}

/// Returns the matrix that predicts the values after steps from those before them; `None` without steps.
fn regression(all: &[Steps<'_>]) -> Option<Array2<f64>> {
    let (inputs, outputs) = all.first().map(|steps| (steps.before.ncols(), steps.after.ncols()))?;
    let (mut square, mut across) = (Array2::zeros((inputs, inputs)), Array2::zeros((inputs, outputs)));
    let mut count = 0;
    for Steps { before, after } in all {
        add_product_parallel(before.t(), &Panels::of(*before), square.view_mut());
        add_product_parallel(before.t(), &Panels::of(*after), across.view_mut());
        count += before.nrows();
    }
    let ridge = RIDGE * count as f64;
    let damped = DMatrix::from_fn(inputs, inputs, |i, j| square[[i, j]] + if i == j { ridge } else { 0.0 });
    let solution = damped.cholesky()?.solve(&DMatrix::from_fn(inputs, outputs, |i, j| across[[i, j]]));
    Some(Array2::from_shape_fn((inputs, outputs), |(i, j)| solution[(i, j)]))
}

impl Steps<'_> {
    /// Returns the steps before `index` and those from there on.
    fn split_at(self, index: usize) -> (Self, Self) {
        let (before, after) = (self.before.split_at(Axis(0), index), self.after.split_at(Axis(0), index));
        (Self { before: before.0, after: after.0 }, Self { before: before.1, after: after.1 })
    }

    /// Returns what a matrix does not predict.
    fn residuals(&self, matrix: &Array2<f64>) -> Array2<f64> {
        let mut predicted = Array2::zeros(self.after.dim());
        add_product_parallel(self.before, &Panels::of(matrix.view()), predicted.view_mut());
        &self.after - &predicted
    }
}

/// Means and deviations of values.
struct Units {
    mean: Vec<f64>,
    /// 0 for a value that does not change.
    deviation: Vec<f64>,
}

impl Units {
    fn of(arrays: &[Array2<f32>]) -> Self {
        let cols = arrays.first().map_or(0, Array2::ncols);
        let (mean, variance) = mean_and_variance(cols, || arrays.iter().flat_map(|array| array.rows()));
        let changes = |col: usize| {
            let mut values = arrays.iter().flat_map(|array| array.column(col).into_iter().copied());
            let first = values.next();
            values.any(|value| Some(value) != first)
        };
        let deviation =
            variance.iter().enumerate().map(|(col, variance)| if changes(col) { variance.sqrt() } else { 0.0 });
        Self { deviation: deviation.collect(), mean }
    }

    /// Returns rows in units of the deviations, without the means.
    fn of_rows(&self, rows: ArrayView2<'_, f32>) -> Array2<f64> {
        Array2::from_shape_fn(rows.dim(), |(row, col)| match self.deviation[col] {
            deviation if deviation > 0.0 => (f64::from(rows[[row, col]]) - self.mean[col]) / deviation,
            _ => 0.0,
        })
    }
}

#[cfg(test)]
mod tests {
    use ndarray::array;

    use super::*;
    use crate::random::Random;

    /// Drives `x' = A x + B u` with random answers, and a third value that never changes.
    fn driven(episodes: usize, steps: usize) -> (Vec<Array2<f32>>, Vec<Array2<f32>>) {
        let mut random = Random::new(7);
        let mut observed = Vec::new();
        let mut answers = Vec::new();
        for _ in 0..episodes {
            let u = Array2::from_shape_fn((steps, 1), |_| 10.0 * random.normal());
            let mut x = Array2::from_elem((steps, 3), 4.0);
            let mut now = [random.normal(), random.normal()];
            for t in 0..steps {
                (x[[t, 0]], x[[t, 1]]) = (now[0], now[1]);
                now = [0.9 * now[0] + 0.2 * now[1], 0.7 * now[1] + 0.1 * u[[t, 0]]];
            }
            observed.push(x);
            answers.push(u);
        }
        (observed, answers)
    }

    #[test]
    fn a_linear_robot_is_found() {
        let (observed, answers) = driven(4, 300);
        let model = Dynamics::fit(&observed, &answers).expect("a model");
        assert!(model.predicted > 0.99, "{}", model.predicted);
        let Dynamics { observation, answer, .. } = &model;
        assert_eq!(observation[2], 0.0, "a value that never changes");
        let moved = [1.0, -2.0, 0.0, 5.0];
        let units = [observation[0], observation[1], 1.0, answer[0]];
        let difference = Array2::from_shape_fn((1, 4), |(_, i)| moved[i] / units[i]);
        let next = model.next(difference.view());
        let expected = [0.9 - 0.4, -1.4 + 0.5];
        for (value, expected) in expected.into_iter().enumerate() {
            let found = next[[0, value]] * observation[value];
            assert!((found - expected).abs() < 0.02, "{value}: {found}, not {expected}");
        }
        assert_eq!(next[[0, 2]], 0.0);
    }

    #[test]
    fn one_episode_is_measured_on_its_last_quarter() {
        let (observed, answers) = driven(1, 300);
        assert!(Dynamics::fit(&observed, &answers).expect("a model").predicted > 0.99);
    }

    #[test]
    fn frames_in_random_order_are_not_predicted() {
        let mut random = Random::new(9);
        let noise = Array2::from_shape_fn((400, 3), |_| random.normal());
        let answers = noise.slice(s![.., ..1]).to_owned();
        let predicted = Dynamics::fit(&[noise], &[answers]).expect("a model").predicted;
        assert!(predicted.abs() < 0.1, "{predicted}");
    }

    #[test]
    fn single_frames_have_no_model() {
        let frames = [array![[1.0f32, 2.0]], array![[2.0, 1.0]]];
        assert!(Dynamics::fit(&frames, &[array![[0.5f32]], array![[1.5]]]).is_none());
        assert!(Dynamics::fit(&[], &[]).is_none());
    }
}
