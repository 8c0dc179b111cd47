//! The range that each value of an observation covers in a recording, and what leaves it.

use super::dataset::Dataset;

/// How far beyond the calibrated range, as a share of its width, a value still counts as inside.
const MARGIN: f32 = 0.1;
/// Share of observations outside from which on it is worth a warning.
const WORTH: f64 = 0.05;
/// Dimensions that a warning names.
const NAMED: usize = 5;

/// Smallest and largest recorded value of each dimension of an observation.
#[derive(Clone, Debug)]
pub struct Range {
    /// Where they were recorded, for messages.
    name: String,
    bounds: Vec<(f32, f32)>,
}

/// How much of another recording lies outside.
#[derive(Clone, Debug, PartialEq)]
pub struct Outside {
    /// Observations that were looked at.
    pub frames: usize,
    /// Those of them with at least one value outside.
    pub outside: usize,
    /// Dimension and how many observations leave its range, the worst first; only where there are any.
    pub dimensions: Vec<(usize, usize)>,
}

impl Range {
    /// Of the valid steps of a recording.
    pub fn of(dataset: &Dataset) -> Self {
        let mut bounds = vec![(f32::INFINITY, f32::NEG_INFINITY); dataset.obs.dim().2];
        for observation in dataset.observations() {
            for ((low, high), v) in bounds.iter_mut().zip(observation) {
                (*low, *high) = (low.min(*v), high.max(*v));
            }
        }
        Self { name: dataset.name().into_owned(), bounds }
    }

    /// A note that names the dimensions that never change, where there are any.
    pub fn constant_note(&self) -> Option<String> {
        let constant: Vec<usize> = (0..self.bounds.len()).filter(|&i| self.bounds[i].0 == self.bounds[i].1).collect();
        let (dimensions, verb, they) = match constant.len() {
            0 => return None,
            1 => ("dimension", "never changes", "it moves"),
            _ => ("dimensions", "never change", "they move"),
        };
        Some(format!(
            "observation {dimensions} {} {verb} in {}: nothing is known about what the policy does when {they}; if the \
             robot can change {} at run time, record episodes in which it does",
            runs(&constant),
            self.name,
            if constant.len() == 1 { "it" } else { "them" },
        ))
    }

    /// How much of `dataset` leaves the range by more than a tenth of its width.
    pub fn outside(&self, dataset: &Dataset) -> Outside {
        let mut counts = vec![0; self.bounds.len()];
        let (mut frames, mut outside) = (0, 0);
        for observation in dataset.observations() {
            let mut any = false;
            for ((count, (low, high)), v) in counts.iter_mut().zip(&self.bounds).zip(observation) {
                let margin = MARGIN * (high - low);
                if *v < low - margin || *v > high + margin {
                    *count += 1;
                    any = true;
                }
            }
            frames += 1;
            outside += usize::from(any);
        }
        let mut dimensions: Vec<(usize, usize)> = counts.into_iter().enumerate().filter(|(_, n)| *n > 0).collect();
        dimensions.sort_by_key(|&(dimension, count)| (std::cmp::Reverse(count), dimension));
        Outside { frames, outside, dimensions }
    }

    /// A warning where more than a twentieth of `dataset` leaves the range.
    pub fn warning(&self, dataset: &Dataset) -> Option<String> {
        let Outside { frames, outside, dimensions } = self.outside(dataset);
        let percent = |n: usize| format!("{:.1}%", 100.0 * n as f64 / frames.max(1) as f64);
        if outside as f64 <= WORTH * frames as f64 {
            return None;
        }
        let worst: Vec<String> =
            dimensions.iter().take(NAMED).map(|(dimension, n)| format!("{dimension} ({})", percent(*n))).collect();
        let more = dimensions.len().saturating_sub(NAMED);
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        Some(format!(
            "{} of the observations in {} leave the range of {} by more than 10% of it, in dimensions {}{more}: nothing \
             saturates there, but nothing was fitted there either; record what the robot will see",
            percent(outside),
            dataset.name(),
            self.name,
            worst.join(", "),
        ))
    }
}

/// Rising numbers as text: `3, 7-9`.
pub fn runs(numbers: &[usize]) -> String {
    let chunks = numbers.chunk_by(|a, b| a + 1 == *b);
    let text = chunks.map(|run| match run {
        [first, .., last] => format!("{first}-{last}"),
        _ => run.iter().map(usize::to_string).collect(),
    });
    text.collect::<Vec<_>>().join(", ")
}
