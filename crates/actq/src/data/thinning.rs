//! Thins a long recording by keeping the most diverse frames. Blind thinning would keep a thousand frames of a robot at
//! rest and lose the one in which it stumbles.
//!
//! Observations are standardized and counted by the cells of a grid. One frame of a cell is kept. The cells are as wide
//! as necessary for all frames to fit.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashSet};

use ndarray::ArrayView1;

use super::dataset::{Dataset, mean_and_variance};

/// A frame of one of several recordings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Place {
    /// Index of the recording.
    pub(super) part: usize,
    /// Index of the episode in it.
    pub(super) episode: usize,
    /// Step of the episode.
    pub(super) step: usize,
}

/// Returns all valid frames, episode after episode, in the order of [`observations`].
pub(super) fn places(parts: &[Dataset]) -> Vec<Vec<Place>> {
    let steps = |part: usize, episode: usize, length: usize| -> Vec<Place> {
        (0..length).map(|step| Place { part, episode, step }).collect()
    };
    let of_part = |(part, dataset): (usize, &Dataset)| -> Vec<Vec<Place>> {
        dataset.length.iter().enumerate().map(|(episode, &length)| steps(part, episode, length)).collect()
    };
    parts.iter().enumerate().flat_map(of_part).filter(|episode| !episode.is_empty()).collect()
}

/// Returns at most `most` frames, the first of every cell, in the order of recording.
pub(super) fn frames(parts: &[Dataset], most: usize) -> Vec<Place> {
    let grid = Grid::fitting(parts, most);
    let mut visited = HashSet::new();
    let all = places(parts).into_iter().flatten().zip(observations(parts));
    all.filter(|(_, observation)| visited.insert(grid.cell(observation))).map(|(place, _)| place).collect()
}

/// Returns whole episodes of at most `most` frames together, in the order of recording. It repeatedly takes the episode
/// that visits most cells which no earlier one has visited. A longer episode is cut to its beginning.
pub(super) fn episodes(parts: &[Dataset], most: usize) -> Vec<Vec<Place>> {
    let grid = Grid::fitting(parts, most);
    let mut observations = observations(parts);
    let mut candidates = places(parts);
    let mut cells: Vec<HashSet<u64>> = Vec::new();
    for episode in &mut candidates {
        let own: Vec<u64> = observations.by_ref().take(episode.len()).map(|o| grid.cell(&o)).collect();
        episode.truncate(most);
        cells.push(own.into_iter().take(most).collect());
    }
    // An episode's gain only falls as others are chosen, so most need no recount.
    let mut queue: BinaryHeap<(usize, Reverse<usize>)> =
        cells.iter().enumerate().map(|(e, cells)| (cells.len(), Reverse(e))).collect();
    let (mut visited, mut chosen, mut room) = (HashSet::new(), Vec::new(), most);
    while let Some((_, Reverse(e))) = queue.pop() {
        let added = cells[e].difference(&visited).count();
        if candidates[e].len() > room || added == 0 {
            continue;
        }
        let entry = (added, Reverse(e));
        if queue.peek().is_some_and(|next| *next > entry) {
            queue.push(entry);
            continue;
        }
        visited.extend(&cells[e]);
        room -= candidates[e].len();
        chosen.push(e);
    }
    chosen.sort_unstable();
    chosen.into_iter().map(|e| std::mem::take(&mut candidates[e])).collect()
}

fn observations(parts: &[Dataset]) -> impl Iterator<Item = ArrayView1<'_, f32>> {
    parts.iter().flat_map(Dataset::observations)
}

/// Cells of equal width over standardized observations; one is centred on their mean.
struct Grid {
    mean: Vec<f64>,
    /// Reciprocal of a cell's width, in units of each value; 0 for a value that never changes.
    cells: Vec<f64>,
}

impl Grid {
    /// Finest cell width, in standard deviations: closer frames are equivalent.
    const FINEST: f64 = 1.0 / 1024.0;
    /// Most halvings of the range of widths.
    const HALVINGS: usize = 12;

    /// Returns a grid with approximately the smallest cells of which at most `most` are visited.
    fn fitting(parts: &[Dataset], most: usize) -> Self {
        let unit = Self::of(parts);
        // Search widths by their ratio.
        let fits = |width: f64| unit.with_width(width).visited(parts, most);
        let (mut narrow, mut wide) = (Self::FINEST, Self::FINEST);
        let mut visited = fits(wide);
        // No observation is further from the mean than the root of their number, so eventually one cell holds all.
        while visited.is_none() {
            (narrow, wide) = (wide, 4.0 * wide);
            visited = fits(wide);
        }
        for _ in 0..Self::HALVINGS {
            // Stop when 95% of the room is used.
            if narrow == wide || visited.is_some_and(|n| n >= most - most / 20) {
                break;
            }
            let middle = (narrow * wide).sqrt();
            match fits(middle) {
                None => narrow = middle,
                found => (wide, visited) = (middle, found),
            }
        }
        unit.with_width(wide)
    }

    /// Makes a grid with cells one standard deviation wide.
    fn of(parts: &[Dataset]) -> Self {
        let values = parts.first().map_or(0, |part| part.obs.dim().2);
        let (mean, variance) = mean_and_variance(values, || observations(parts));
        Self { cells: variance.into_iter().map(|v| if v > 0.0 { v.sqrt().recip() } else { 0.0 }).collect(), mean }
    }

    fn with_width(&self, width: f64) -> Self {
        Self { mean: self.mean.clone(), cells: self.cells.iter().map(|n| n / width).collect() }
    }

    /// Counts the visited cells; `None` if they are more than `most`.
    fn visited(&self, parts: &[Dataset], most: usize) -> Option<usize> {
        let mut visited = HashSet::new();
        for observation in observations(parts) {
            visited.insert(self.cell(&observation));
            if visited.len() > most {
                return None;
            }
        }
        Some(visited.len())
    }

    /// Returns a hash of the cell. A collision among a million cells is unlikely, and would cost one frame.
    fn cell(&self, observation: &ArrayView1<'_, f32>) -> u64 {
        let mut number = 0u64;
        for ((v, mean), cells) in observation.iter().zip(&self.mean).zip(&self.cells) {
            let at = ((f64::from(*v) - mean) * cells).round() as i64;
            // SplitMix64's steps (Steele, Lea, Flood: Fast splittable pseudorandom number generators, 2014).
            number = (number ^ at as u64).wrapping_add(0x9e37_79b9_7f4a_7c15);
            number = (number ^ (number >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            number = (number ^ (number >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            number ^= number >> 31;
        }
        number
    }
}

#[cfg(test)]
mod tests {
    use ndarray::Array3;

    use super::*;

    /// Makes a recording of episodes with one value per step.
    fn recorded(episodes: &[&[f32]]) -> Dataset {
        let longest = episodes.iter().map(|e| e.len()).max().unwrap_or(0);
        let value = |(e, s, _): (usize, usize, usize)| episodes[e].get(s).copied().unwrap_or(f32::NAN);
        Dataset {
            path: "drive.npz".into(),
            obs: Array3::from_shape_fn((episodes.len(), longest, 1), value),
            action: None,
            length: episodes.iter().map(|e| e.len()).collect(),
            state: None,
        }
    }

    #[test]
    fn rare_frames_are_kept() {
        // A robot that does not move, and stumbles once in the second file.
        let standing: Vec<f32> = (0..1000).map(|i| 1e-3 * (i % 7) as f32).collect();
        let mut stumbles = standing.clone();
        stumbles[700] = 4.0;
        let parts = [recorded(&[&standing]), recorded(&[&standing[..5], &stumbles])];
        let kept = frames(&parts, 20);
        assert!(kept.len() <= 20, "{}", kept.len());
        assert!(kept.contains(&Place { part: 1, episode: 1, step: 700 }), "{kept:?}");
        assert_eq!(kept[0], Place { part: 0, episode: 0, step: 0 }, "the first of equal frames is kept");
    }

    #[test]
    fn thinning_uses_most_of_the_limit() {
        let spread: Vec<f32> = (0..5000).map(|i| (i as f32 * 0.37).sin() + 1e-3 * i as f32).collect();
        let parts = [recorded(&[&spread])];
        for most in [1, 10, 100, 1000] {
            let kept = frames(&parts, most).len();
            assert!(kept <= most && kept >= most * 3 / 4, "{kept} of {most}");
        }
        // A constant value has one cell, whatever the limit.
        assert_eq!(frames(&[recorded(&[&[2.5; 50]])], 10).len(), 1);
    }

    #[test]
    fn episodes_with_new_cells_are_chosen() {
        let walk = |from: f32, n: usize| -> Vec<f32> { (0..n).map(|i| from + i as f32).collect() };
        let (near, far, again, short) = (walk(0.0, 40), walk(100.0, 30), walk(0.0, 39), walk(200.0, 10));
        let parts = [recorded(&[&near, &again]), recorded(&[&far, &short])];
        let chosen = |most: usize| -> Vec<(usize, usize, usize)> {
            episodes(&parts, most).iter().map(|e| (e[0].part, e[0].episode, e.len())).collect()
        };
        // The repetition adds nothing, although it would fit.
        assert_eq!(chosen(119), [(0, 0, 40), (1, 0, 30), (1, 1, 10)]);
        assert_eq!(chosen(70), [(0, 0, 40), (1, 0, 30)]);
        // It is too long for the rest; the next one fits.
        assert_eq!(chosen(55), [(0, 0, 40), (1, 1, 10)]);
        // None fits: take the beginning of one.
        assert_eq!(chosen(8).iter().map(|e| e.2).collect::<Vec<_>>(), [8]);
    }
}
