//! The loss of learning: the squared difference to the f32 network's outputs over their variances.

use ndarray::{Array2, ArrayView1};

use crate::graph::Graph;
use crate::methods::options::Options;

/// Loss of a batch, with its derivative.
#[derive(Debug)]
pub struct Objective<'a> {
    variance: &'a [f32],
    /// Outputs that vary.
    varying: usize,
    /// Weighting of frames.
    frames: Frames,
}

/// Weighting of frames. A robot that holds its goal by small actions stays as far off as their error, which a mean over
/// all frames hardly counts. So a frame has the weight `1 / (a + c)`; `a` is the mean square of the f32 network's
/// outputs there in units of their variances (docs/records/2026-11-23-hold.md).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Frames {
    /// Equal weights.
    Even,
    /// `c` is 1: a frame at rest counts twice as much as a typical one, a wide movement less than that.
    Mild,
    /// `c` is 0.3: errors count in units of the action itself, down to about half of the deviation.
    Relative,
}

impl Frames {
    /// Returns the weighting for a network. A recurrent policy that balances succeeds in fewer episodes unless all
    /// frames count equally.
    pub fn of(options: &Options, graph: &Graph) -> Self {
        match options.relative {
            true => Self::Relative,
            false if graph.state_len() > 0 => Self::Even,
            false => Self::Mild,
        }
    }

    fn floor(self) -> Option<f32> {
        match self {
            Self::Even => None,
            Self::Mild => Some(1.0),
            Self::Relative => Some(0.3),
        }
    }
}

impl<'a> Objective<'a> {
    /// Makes the loss: the mean over samples and outputs of squared error over variance. Except for [`Frames::Even`],
    /// each error is multiplied by the frame's weight, which is 1 on average over a batch.
    pub fn new(variance: &'a [f32], frames: Frames) -> Self {
        let varying = variance.iter().filter(|variance| **variance > 0.0).count().max(1);
        Self { variance, varying, frames }
    }

    /// Returns the derivative by the outputs, `[frame, element]`, and the loss against the f32 network's outputs.
    /// Outputs that do not vary do not count.
    pub fn measure(&self, outputs: &Array2<f32>, target: &Array2<f32>) -> (Array2<f32>, f32) {
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

    /// Returns the weights of frames, 1 on average.
    fn of_frames(&self, target: &Array2<f32>) -> Vec<f32> {
        let Some(floor) = self.frames.floor() else { return vec![1.0; target.nrows()] };
        let weight = |row: ArrayView1<'_, f32>| {
            let varying = row.iter().zip(self.variance).filter(|(_, variance)| **variance > 0.0);
            let size = varying.map(|(a, variance)| a * a / variance).sum::<f32>() / self.varying as f32;
            1.0 / (size + floor)
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

    /// Variances of one output that varies and one that does not.
    const VARIANCE: [f32; 2] = [4.0, 0.0];

    #[test]
    fn small_actions_increase_the_weight_of_errors() {
        let target = array![[0.0, 5.0], [2.0, 5.0]];
        let outputs = array![[0.2, 9.0], [2.2, 9.0]];
        let (even, loss) = Objective::new(&VARIANCE, Frames::Even).measure(&outputs, &target);
        assert!((loss - 0.01).abs() < 1e-6, "{loss}");
        assert!((even[[0, 0]] - even[[1, 0]]).abs() < 1e-7 && even.column(1).iter().all(|d| *d == 0.0));
        for (frames, expected) in [(Frames::Mild, 2.0), (Frames::Relative, 13.0 / 3.0)] {
            let (weighed, loss) = Objective::new(&VARIANCE, frames).measure(&outputs, &target);
            assert!((loss - 0.01).abs() < 1e-6, "weights are 1 on average: {loss}");
            let ratio = weighed[[0, 0]] / weighed[[1, 0]];
            assert!((ratio - expected).abs() < 1e-3, "{ratio}");
        }
    }

    #[test]
    fn the_derivative_agrees_with_the_loss() {
        let target = array![[0.1, 0.0], [-3.0, 0.0], [1.0, 0.0]];
        let outputs = array![[0.5, 0.0], [-2.0, 0.0], [1.5, 0.0]];
        for frames in [Frames::Even, Frames::Mild, Frames::Relative] {
            let objective = Objective::new(&VARIANCE, frames);
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
