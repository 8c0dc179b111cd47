//! What learning lowers: the squared difference to the f32 network's outputs, over their variances.

use ndarray::{Array2, ArrayView1};

/// A robot that holds its goal by small actions stays as far off it as they are wrong. So learning can weigh a frame by
/// `1 / (a + FLOOR)`, with `a` the mean square of the f32 network's outputs there in units of their variances: the
/// error counts in units of the action itself, down to about a third of the deviation.
const FLOOR: f32 = 0.1;

/// The loss of a batch and its derivative.
#[derive(Debug)]
pub(super) struct Objective<'a> {
    variance: &'a [f32],
    /// Outputs that vary.
    varying: usize,
    /// Whether frames are weighed by the size of their action.
    relative: bool,
}

impl<'a> Objective<'a> {
    /// Every frame counts alike: the mean over samples and outputs of squared error over variance.
    pub(super) fn even(variance: &'a [f32]) -> Self {
        let varying = variance.iter().filter(|variance| **variance > 0.0).count().max(1);
        Self { variance, varying, relative: false }
    }

    /// Frames count the more, the smaller their action is, with 1 in the mean over a batch.
    pub(super) fn relative(variance: &'a [f32]) -> Self {
        Self { relative: true, ..Self::even(variance) }
    }

    /// The derivative by the outputs, `[frame, element]`, and the loss, for what the f32 network gives. Outputs that do
    /// not vary count for nothing.
    pub(super) fn measure(&self, outputs: &Array2<f32>, target: &Array2<f32>) -> (Array2<f32>, f32) {
        let count = (target.nrows() * self.varying) as f32;
        let weight = |variance: &f32| if *variance > 0.0 { 1.0 / (variance * count) } else { 0.0 };
        let of_outputs: Vec<f32> = self.variance.iter().map(weight).collect();
        let mut loss = 0.0;
        let mut error = outputs - target;
        for (mut row, of_frame) in error.rows_mut().into_iter().zip(self.of_frames(target)) {
            for (d, of_output) in row.iter_mut().zip(&of_outputs) {
                let weight = of_frame * of_output;
                loss += *d * *d * weight;
                *d *= 2.0 * weight;
            }
        }
        (error, loss)
    }

    /// The weights of frames, 1 in the mean.
    fn of_frames(&self, target: &Array2<f32>) -> Vec<f32> {
        if !self.relative {
            return vec![1.0; target.nrows()];
        }
        let weight = |row: ArrayView1<'_, f32>| {
            let varying = row.iter().zip(self.variance).filter(|(_, variance)| **variance > 0.0);
            let size = varying.map(|(a, variance)| a * a / variance).sum::<f32>() / self.varying as f32;
            1.0 / (size + FLOOR)
        };
        let mut weights: Vec<f32> = target.rows().into_iter().map(weight).collect();
        let mean = weights.iter().sum::<f32>() / weights.len().max(1) as f32;
        weights.iter_mut().for_each(|weight| *weight /= mean);
        weights
    }
}

#[cfg(test)]
mod tests {
    use ndarray::array;

    use super::*;

    /// One output, and one that never varies.
    const VARIANCE: [f32; 2] = [4.0, 0.0];

    #[test]
    fn errors_of_equal_size_count_more_where_actions_are_small() {
        let target = array![[0.0, 5.0], [2.0, 5.0]];
        let outputs = array![[0.2, 9.0], [2.2, 9.0]];
        let (even, loss) = Objective::even(&VARIANCE).measure(&outputs, &target);
        assert!((loss - 0.01).abs() < 1e-6, "{loss}");
        assert!((even[[0, 0]] - even[[1, 0]]).abs() < 1e-7 && even.column(1).iter().all(|d| *d == 0.0));
        let (relative, loss) = Objective::relative(&VARIANCE).measure(&outputs, &target);
        assert!((loss - 0.01).abs() < 1e-6, "weights are 1 in the mean: {loss}");
        let ratio = relative[[0, 0]] / relative[[1, 0]];
        assert!((ratio - (1.0 + FLOOR) / FLOOR).abs() < 1e-3, "{ratio}");
    }

    #[test]
    fn the_derivative_is_that_of_the_loss() {
        let target = array![[0.1, 0.0], [-3.0, 0.0], [1.0, 0.0]];
        let outputs = array![[0.5, 0.0], [-2.0, 0.0], [1.5, 0.0]];
        for objective in [Objective::even(&VARIANCE), Objective::relative(&VARIANCE)] {
            let (derivative, _) = objective.measure(&outputs, &target);
            for frame in 0..3 {
                let at = |step: f32| {
                    let mut moved = outputs.clone();
                    moved[[frame, 0]] += step;
                    objective.measure(&moved, &target).1
                };
                let finite = (at(0.01) - at(-0.01)) / 0.02;
                assert!((finite - derivative[[frame, 0]]).abs() < 1e-4, "{finite}");
            }
        }
    }
}
