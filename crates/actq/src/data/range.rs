//! Range of each value of an observation in a recording, and values outside of it.

use super::dataset::Dataset;

/// Margin around the calibrated range, as a share of its width, within which a value counts as inside.
const MARGIN: f32 = 0.1;
/// Share of observations outside the range above which a warning is given.
const MIN_OUTSIDE_SHARE: f64 = 0.05;
/// Most dimensions that a warning names.
const MAX_NAMED: usize = 5;

/// Smallest and largest recorded value of each dimension of an observation.
#[derive(Clone, Debug)]
pub struct Range {
    /// Name of the recording, for messages.
    name: String,
    bounds: Vec<(f32, f32)>,
}

/// Observations of another recording outside the range.
#[derive(Clone, Debug, PartialEq)]
pub struct Outside {
    /// Observations examined.
    pub frames: usize,
    /// Observations with at least one value outside.
    pub outside: usize,
    /// Dimensions outside their range with their numbers of observations, the worst first.
    pub dimensions: Vec<(usize, usize)>,
}

impl Range {
    /// Returns the range of the valid steps of a recording.
    pub fn of(dataset: &Dataset) -> Self {
        let mut bounds = vec![(f32::INFINITY, f32::NEG_INFINITY); dataset.obs.dim().2];
        for observation in dataset.observations() {
            for ((low, high), v) in bounds.iter_mut().zip(observation) {
                (*low, *high) = (low.min(*v), high.max(*v));
            }
        }
        Self { name: dataset.name().into_owned(), bounds }
    }

    /// Returns a note that names the dimensions that never change, if there are any.
    pub fn constant_note(&self) -> Option<String> {
        let constant: Vec<usize> = (0..self.bounds.len()).filter(|&i| self.bounds[i].0 == self.bounds[i].1).collect();
        let (dimensions, verb, they) = match constant.len() {
            0 => return None,
            1 => ("dimension", "never changes", "it moves"),
            _ => ("dimensions", "never change", "they move"),
        };
        Some(format!(
            "observation {dimensions} {} {verb} in {}, so the image's response when {they} is not calibrated; if the \
             robot can change {} at run time, record episodes in which it does",
            runs(&constant),
            self.name,
            if constant.len() == 1 { "it" } else { "them" },
        ))
    }

    /// Counts observations of `dataset` that leave the range by more than a tenth of its width.
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

    /// Returns a warning if more than a twentieth of `dataset` leaves the range.
    pub fn warning(&self, dataset: &Dataset) -> Option<String> {
        let Outside { frames, outside, dimensions } = self.outside(dataset);
        let percent = |n: usize| format!("{:.1}%", 100.0 * n as f64 / frames.max(1) as f64);
        if outside as f64 <= MIN_OUTSIDE_SHARE * frames as f64 {
            return None;
        }
        let worst: Vec<String> =
            dimensions.iter().take(MAX_NAMED).map(|(dimension, n)| format!("{dimension} ({})", percent(*n))).collect();
        let more = dimensions.len().saturating_sub(MAX_NAMED);
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        Some(format!(
            "{} of the observations in {} leave the range of {} by more than 10% of it, in dimensions {}{more}: values \
             there do not saturate, but the image was not fitted to them; record what the robot will observe",
            percent(outside),
            dataset.name(),
            self.name,
            worst.join(", "),
        ))
    }
}

/// Formats rising numbers as text: `3, 7-9`.
pub fn runs(numbers: &[usize]) -> String {
    let chunks = numbers.chunk_by(|a, b| a + 1 == *b);
    let text = chunks.map(|run| match run {
        [first, .., last] => format!("{first}-{last}"),
        _ => run.iter().map(usize::to_string).collect(),
    });
    text.collect::<Vec<_>>().join(", ")
}
