//! The action loss of ActQuant's Fisher information, and its derivative at the network's output.

use actq::data::Dataset;
use actq::random::Random;

/// Derivative of the loss if the recorded action is the network's own, or nearly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Signs {
    /// That for a label drawn from the model, from a fixed seed: the L1 part is 1 or -1 with equal probability. The
    /// expectation of its square is `sum over d of (dy_d/dw)^2`.
    Random,
    /// Result of automatic differentiation: the derivative for any difference, however small, and 0 without one.
    Loss,
}

/// Share of a dimension's standard deviation below which an output counts as equal to its record.
const EQUAL: f32 = 1e-3;

/// `(1 - alpha) NLL + alpha L1` of an action, summed over its dimensions.
///
/// The paper's NLL is that of action tokens. Networks here have none, so it is that of a Gaussian around the output
/// with the standard deviation s of the recorded actions. Its derivative is `(y - t) / s^2`, and that of L1 is the sign
/// of `y - t`. A dimension that never varies has no NLL.
#[derive(Debug)]
pub(super) struct ActionLoss {
    alpha: f32,
    signs: Signs,
    /// The standard deviation of each dimension of the recorded actions.
    deviations: Vec<f32>,
    random: Random,
}

impl ActionLoss {
    /// Returns `None` if the recording has no actions.
    pub(super) fn new(dataset: &Dataset, alpha: f64, signs: Signs) -> Option<Self> {
        Some(Self { alpha: alpha as f32, signs, deviations: deviations(dataset)?, random: Random::new(0) })
    }

    /// Returns the derivative by an output of dimension `d` that lies `difference` above the recorded action.
    pub(super) fn derivative(&mut self, d: usize, difference: f32) -> f32 {
        let deviation = self.deviations[d];
        let is_equal = difference.abs() <= EQUAL * deviation;
        let (sign, difference) = match self.signs {
            Signs::Random if is_equal && self.alpha == 1.0 => (self.random.sign(), 0.0),
            Signs::Random if is_equal => {
                let drawn = self.random.normal();
                (drawn.signum(), drawn * deviation)
            }
            Signs::Loss if difference == 0.0 => return 0.0,
            _ => (difference.signum(), difference),
        };
        let variance = deviation * deviation;
        let likelihood = if self.alpha < 1.0 && variance > 0.0 { difference / variance } else { 0.0 };
        (1.0 - self.alpha) * likelihood + self.alpha * sign
    }
}

/// Returns the standard deviation of every dimension of the recorded actions.
fn deviations(dataset: &Dataset) -> Option<Vec<f32>> {
    let width = dataset.action.as_ref()?.dim().2;
    let mut sums = vec![(0f64, 0f64); width];
    for (episode, &length) in dataset.length.iter().enumerate() {
        for step in 0..length {
            for ((sum, square), a) in sums.iter_mut().zip(dataset.action_at(episode, step)?) {
                *sum += f64::from(a);
                *square += f64::from(a).powi(2);
            }
        }
    }
    let n = dataset.frames().max(1) as f64;
    Some(sums.iter().map(|(sum, square)| (square / n - (sum / n).powi(2)).max(0.0).sqrt() as f32).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn loss(alpha: f32, signs: Signs) -> ActionLoss {
        ActionLoss { alpha, signs, deviations: vec![0.5, 2.0, 0.0], random: Random::new(1) }
    }

    #[test]
    fn recorded_differences_mix_both_derivatives() {
        let mut half = loss(0.5, Signs::Random);
        assert_eq!([1.0, -1.0].map(|difference| half.derivative(0, difference)), [2.5, -2.5]);
        assert_eq!(half.derivative(1, 4.0), 1.0);
        assert_eq!(half.derivative(2, 4.0), 0.5, "no likelihood of a constant");
        assert_eq!(loss(1.0, Signs::Random).derivative(1, -4.0), -1.0);
        assert_eq!(loss(0.0, Signs::Loss).derivative(1, -4.0), -1.0);
        assert_eq!(loss(0.5, Signs::Loss).derivative(0, 0.0), 0.0);
    }

    #[test]
    fn drawn_labels_have_the_expected_square() {
        // (1 - alpha)^2 / s^2 + 2 alpha (1 - alpha) sqrt(2 / pi) / s + alpha^2, with s = 2.
        for (alpha, expected) in
            [(1.0, 1.0), (0.0, 0.25), (0.5, 0.25 * (0.25 + (2.0 / std::f32::consts::PI).sqrt() + 1.0))]
        {
            let mut loss = loss(alpha, Signs::Random);
            let mean = (0..20_000).map(|_| loss.derivative(1, 0.0).powi(2)).sum::<f32>() / 20_000.0;
            assert!((mean - expected).abs() < 0.02 * expected, "alpha {alpha}: {mean} against {expected}");
        }
    }
}
