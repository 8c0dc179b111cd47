//! Recordings whose axes are in another order.

use ndarray::{Array3, ArrayView3, Axis, Slice};

use super::dataset::{Dataset, mean_and_variance};
use crate::numbers::square;

/// Ratio of the mean squared differences of neighbours along the two axes above which the axes are in another order.
const SMOOTHER: f64 = 4.0;
/// Ratio of the differences two and one apart above which values follow each other in time. It is 1 for episodes, which
/// may resemble each other, 2 for a random walk, and 4 for a smooth curve.
const FOLLOWING: f64 = 1.5;

/// Returns a note if a recording looks like [step, robot, value], as several robots at once give it: along its first
/// axis, which is that of episodes, values change less than along that of steps, and follow each other.
pub fn axes_note(dataset: &Dataset) -> Option<String> {
    let (episodes, steps, values) = dataset.obs.dim();
    if episodes < 3 || steps < 2 || dataset.length.iter().any(|length| *length != steps) {
        return None;
    }
    let (_, variance) = mean_and_variance(values, || dataset.observations());
    let apart = |axis: usize, by: usize| change(&dataset.obs, Axis(axis), by, &variance);
    let (first, second) = (apart(0, 1), apart(1, 1));
    if !(SMOOTHER * first < second && apart(0, 2) > FOLLOWING * first) {
        return None;
    }
    Some(format!(
        "{} looks like [step, robot, value]: neighbours along its first axis differ {:.0} times less than along its second. A \
         recording is [episode, step, value]; transpose each array by numpy.swapaxes(array, 0, 1)",
        dataset.name(),
        (second / first.max(f64::MIN_POSITIVE)).min(1e6)
    ))
}

/// Returns the mean squared difference of values `by` places apart along an axis, over the variance of their dimension.
fn change(obs: &Array3<f32>, axis: Axis, by: usize, variance: &[f64]) -> f64 {
    let part = |from: usize| -> ArrayView3<'_, f32> {
        let to = obs.len_of(axis) - by + from;
        obs.slice_axis(axis, Slice::from(from..to))
    };
    let (before, after) = (part(0), part(by));
    let rows = before.rows().into_iter().zip(after.rows());
    let changes = rows.flat_map(|(before, after)| {
        let pairs = before.into_iter().zip(after).zip(variance).filter(|(_, variance)| **variance > 0.0);
        pairs.map(|((before, after), variance)| square(f64::from(*after) - f64::from(*before)) / variance)
    });
    changes.sum::<f64>() / before.len() as f64
}
