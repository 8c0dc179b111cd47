//! Values far outside of all others of their dimension, as a sensor's glitch gives them, and frames whose actions
//! outweigh all others.

use ndarray::s;

use super::dataset::{Dataset, mean_and_variance};
use crate::numbers::square;
use crate::text::count;

/// Share of a dimension's values, those nearest to its median, that are ordinary.
const ORDINARY: f64 = 0.99;
/// Ratio of successive distances to the median above which the farther value and those beyond it are far outside. The
/// tails of what a robot measures have no such gaps, however heavy they are.
const GAP: f32 = 50.0;
/// Share of the actions' squares in one frame above which there is a note.
const MOST: f64 = 0.5;
/// Fewest frames of a recording for that note.
const LEAST: usize = 16;

/// Values of one dimension far outside of the others.
struct Outside {
    dimension: usize,
    median: f32,
    /// Distance to the median within which all other values are.
    within: f32,
    values: usize,
    /// Place of the farthest, and its value.
    episode: usize,
    step: usize,
    value: f32,
}

/// Distances of a dimension's values to their median.
struct Distances {
    median: f32,
    /// The largest one that is ordinary.
    ordinary: f32,
    /// The others, rising.
    rest: Vec<f32>,
}

impl Distances {
    fn of(mut values: Vec<f32>) -> Self {
        let last = values.len() - 1;
        let median = *values.select_nth_unstable_by(last / 2, f32::total_cmp).1;
        values.iter_mut().for_each(|value| *value = (*value - median).abs());
        // Without the largest one in any case.
        let ordinary = ((ORDINARY * last as f64) as usize).min(last.saturating_sub(1));
        values.select_nth_unstable_by(ordinary, f32::total_cmp);
        let mut rest = values.split_off(ordinary + 1);
        rest.sort_unstable_by(f32::total_cmp);
        Self { median, ordinary: values[ordinary], rest }
    }

    /// Returns the distance within which all values are that are not far outside, and the number of the others. `least`
    /// is what the distance counts as at least, `resting` if it is 0.
    fn gap(&self, least: f32, resting: f32) -> Option<(f32, usize)> {
        let mut within = self.ordinary;
        for (i, distance) in self.rest.iter().enumerate() {
            let counted = if within == 0.0 { resting } else { within.max(least) };
            if *distance > GAP * counted {
                return Some((within, self.rest.len() - i));
            }
            within = *distance;
        }
        None
    }
}

/// Returns the episode and the step of each frame.
fn places(dataset: &Dataset) -> impl Iterator<Item = (usize, usize)> + '_ {
    dataset.length.iter().enumerate().flat_map(|(episode, n)| (0..*n).map(move |step| (episode, step)))
}

/// Returns a note if single values of a recording are far outside of all others of their dimension. A value within the
/// ordinary range of another dimension is none: flags and contacts are seldom other than 0.
pub fn outside_note(dataset: &Dataset) -> Option<String> {
    let dimensions = 0..dataset.obs.dim().2;
    let values = |dimension: usize| dataset.observations().map(move |observation| observation[dimension]);
    let distances: Vec<Distances> = dimensions.clone().map(|i| Distances::of(values(i).collect())).collect();
    let largest = distances.iter().map(|of| of.ordinary).fold(0.0, f32::max);
    let found = dimensions.zip(&distances).filter(|_| largest > 0.0).filter_map(|(dimension, of)| {
        let (within, far) = of.gap(largest / GAP, largest)?;
        let at = places(dataset).zip(values(dimension)).max_by(|a, b| {
            let [a, b] = [a, b].map(|(_, value)| (*value - of.median).abs());
            a.total_cmp(&b)
        });
        let ((episode, step), value) = at?;
        Some(Outside { dimension, median: of.median, within, values: far, episode, step, value })
    });
    let all: Vec<Outside> = found.collect();
    let farness = |of: &Outside| (of.value - of.median).abs() / of.within.max(f32::MIN_POSITIVE);
    let worst = all.iter().max_by(|a, b| farness(a).total_cmp(&farness(b)))?;
    let Outside { dimension, median, within, episode, step, value, .. } = worst;
    let others = all.iter().map(|of| of.values).sum::<usize>() - 1;
    let others = match others {
        0 => String::new(),
        n => format!(", and {} more {} so far outside", count(n, "value"), if n == 1 { "is" } else { "are" }),
    };
    Some(format!(
        "{}: observation dimension {dimension} is {value:.3e} in episode {episode}, step {step}, where all its other values \
         are within {within:.1e} of {median:.1e}{others}: errors count by their squares, so the image learns such values \
         and little else; if a sensor gave them wrongly, leave out these steps",
        dataset.name()
    ))
}

/// Returns a note if one frame of `dataset`, some or all frames of `whole`, has most of the squares of the actions, about
/// their means, by which errors are divided.
pub(crate) fn heavy_note(dataset: &Dataset, whole: &Dataset) -> Option<String> {
    let action = dataset.action.as_ref()?;
    let places: Vec<(usize, usize)> = places(dataset).collect();
    let row = |(episode, step): (usize, usize)| action.slice(s![episode, step, ..]);
    let (mean, variance) = mean_and_variance(action.dim().2, || places.iter().map(|place| row(*place)));
    let moving = variance.iter().filter(|variance| **variance > 0.0).count() as f64;
    let share = |place: (usize, usize)| {
        let of = row(place).into_iter().zip(mean.iter().zip(&variance)).map(|(value, (mean, variance))| {
            if *variance > 0.0 { square(f64::from(*value) - mean) / variance } else { 0.0 }
        });
        of.sum::<f64>() / moving / places.len() as f64
    };
    let heaviest = places.iter().map(|place| (*place, share(*place))).max_by(|a, b| a.1.total_cmp(&b.1));
    let ((episode, step), share) = heaviest.filter(|(_, share)| places.len() >= LEAST && *share > MOST)?;
    let observed = dataset.obs.slice(s![episode, step, ..]);
    let (episode, step) = self::places(whole).zip(whole.observations()).find(|(_, other)| *other == observed)?.0;
    Some(format!(
        "{}: {:.0}% of the actions' variance comes from episode {episode}, step {step}, so the error says little about the \
         other frames, and may be much larger on them; leave out this step",
        dataset.name(),
        100.0 * share
    ))
}
