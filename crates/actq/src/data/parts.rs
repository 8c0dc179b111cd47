//! Parts of a recording that are held out while the rest is learned from.

use std::ops::Range;

use ndarray::{Array2, Array3, Axis, s};

use super::dataset::Dataset;
use crate::graph::{Evaluator, Graph};

/// Frames to hold out in all parts together: fewer successive frames are a few situations, whose error is chance.
const HELD_OUT_FRAMES: usize = 400;
/// Least parts: images that learned from other frames differ by chance.
const MIN_PARTS: usize = 2;
/// Frames of a recording below which a part is a fifth, else a tenth.
const SHORT: usize = 1000;

/// A recording without a part, and the part.
#[derive(Clone, Debug)]
pub struct Part {
    /// Frames to learn from.
    pub learned: Dataset,
    /// Frames that are held out.
    pub held_out: Dataset,
}

impl Dataset {
    /// Returns the parts to hold out in turn: two tenths of a long recording, and up to five fifths of a short one. A part
    /// is whole episodes, or successive frames if the episodes are few. Each leaves at least `least` frames to learn
    /// from; there are none if that cannot be.
    pub fn parts(&self, graph: &Graph, least: usize) -> Vec<Part> {
        let frames = self.frames();
        let divisor = if frames < SHORT && frames - frames.div_ceil(5) >= least { 5 } else { 10 };
        let count = (HELD_OUT_FRAMES * divisor).div_ceil(frames.max(1)).clamp(MIN_PARTS, 5);
        let parts = (0..count).map(|i| self.part(graph, (2 * i + 1) * divisor / (2 * count), divisor));
        parts.filter(|part| part.learned.frames() >= least && part.held_out.frames() > 0).collect()
    }

    /// Returns part `index` of `divisor`.
    pub fn part(&self, graph: &Graph, index: usize, divisor: usize) -> Part {
        let episodes = self.length.iter().filter(|steps| **steps > 0).count();
        let place = |of: usize| self.frames() * of / divisor;
        let (from, to) = (place(index), place(index + 1));
        let (mut learned, mut held_out) = (Vec::new(), Vec::new());
        let mut before = 0;
        for (rank, (episode, &steps)) in self.length.iter().enumerate().filter(|(_, steps)| **steps > 0).enumerate() {
            let (first, end) = match episodes >= divisor {
                true if rank % divisor == index => (0, steps),
                true => (0, 0),
                false => (from.saturating_sub(before).min(steps), to.saturating_sub(before).min(steps)),
            };
            before += steps;
            let not_empty = |piece: &Range<usize>| !piece.is_empty();
            learned.extend([0..first, end..steps].into_iter().filter(not_empty).map(|piece| (episode, piece)));
            held_out.extend(Some(first..end).filter(not_empty).map(|piece| (episode, piece)));
        }
        Part { learned: self.cut(graph, &learned), held_out: self.cut(graph, &held_out) }
    }

    /// Returns pieces of episodes as episodes, each from the state in which the f32 network begins it. Where attention keeps
    /// tokens, they begin without any, and the actions are those of the f32 network from there: an image has its tokens
    /// in another form.
    fn cut(&self, graph: &Graph, pieces: &[(usize, Range<usize>)]) -> Self {
        let longest = pieces.iter().map(|(_, steps)| steps.len()).max().unwrap_or(0);
        let part = |array: &Array3<f32>| {
            let mut part = Array3::zeros((pieces.len(), longest, array.len_of(Axis(2))));
            for (i, (episode, steps)) in pieces.iter().enumerate() {
                part.slice_mut(s![i, ..steps.len(), ..]).assign(&array.slice(s![*episode, steps.clone(), ..]));
            }
            part
        };
        let state = (graph.state_len() > 0 && !graph.keeps_tokens()).then(|| {
            let mut states = Array2::zeros((pieces.len(), graph.state_len()));
            let mut evaluator = Evaluator::new(graph);
            for (mut row, (episode, steps)) in states.rows_mut().into_iter().zip(pieces) {
                evaluator.start(self.start(*episode).as_deref());
                for obs in self.episode(*episode).take(steps.start) {
                    evaluator.step(&obs, &mut |_, _| {});
                }
                row.iter_mut().zip(evaluator.state()).for_each(|(to, from)| *to = from);
            }
            states
        });
        let mut cut = Self {
            path: self.path.clone(),
            obs: part(&self.obs),
            action: self.action.as_ref().map(part),
            length: pieces.iter().map(|(_, steps)| steps.len()).collect(),
            state,
        };
        if graph.keeps_tokens() {
            cut.action = None;
            cut.fill_actions(graph);
        }
        cut
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{dataset, lstm, mlp};

    fn rows(dataset: &Dataset) -> Vec<Vec<f32>> {
        dataset.observations().map(|row| row.to_vec()).collect()
    }

    #[test]
    fn parts_hold_out_every_frame_or_enough() {
        let graph = mlp();
        for (episodes, steps, count, held_out) in
            [(1, 300, 5, 300), (30, 10, 5, 300), (1, 1000, 4, 400), (2, 1000, 2, 400), (20, 200, 2, 800)]
        {
            let whole = dataset(&graph, episodes, steps);
            let parts = whole.parts(&graph, 200);
            let held: usize = parts.iter().map(|part| part.held_out.frames()).sum();
            assert_eq!((parts.len(), held), (count, held_out), "{episodes} episodes of {steps}");
            for Part { learned, held_out } in &parts {
                let mut both = [rows(learned), rows(held_out)].concat();
                let mut all = rows(&whole);
                for rows in [&mut both, &mut all] {
                    rows.sort_by(|a, b| a.partial_cmp(b).expect("numbers"));
                }
                assert!(both == all, "a part and the rest are the recording");
                // Whole episodes, or successive frames.
                assert!(held_out.length.iter().all(|n| *n == steps) || held_out.length.len() <= 2, "{held_out:?}");
            }
        }
        assert!(dataset(&graph, 1, 210).parts(&graph, 200).is_empty(), "too few frames stay");
        assert_eq!(dataset(&graph, 1, 230).parts(&graph, 200)[0].held_out.frames(), 23);
    }

    #[test]
    fn pieces_begin_in_the_state_of_the_whole() {
        let graph = lstm();
        let whole = dataset(&graph, 1, 300);
        for Part { learned, held_out } in whole.parts(&graph, 200) {
            for piece in [learned, held_out] {
                let mut again = Dataset { action: None, ..piece.clone() };
                again.fill_actions(&graph);
                for (episode, &steps) in piece.length.iter().enumerate() {
                    for step in 0..steps {
                        assert_eq!(again.action_at(episode, step), piece.action_at(episode, step));
                    }
                }
            }
        }
    }
}
