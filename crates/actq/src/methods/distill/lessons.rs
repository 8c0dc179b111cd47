//! Batches with the f32 network's outputs. Each output is computed once and learned from several times, in
//! different batches. The f32 network is often larger than the one that learns.

use ndarray::Array2;

use crate::calibrate::windows::{Batch, Windows};
use crate::graph::{Graph, Network, State, Weights};
use crate::random::Random;

/// Times that an output is learned from, on average.
const USES_PER_LESSON: usize = 4;
/// Most lessons that are kept, and most values in all of them.
const MAX_LESSONS: usize = 256;
const MAX_VALUES: usize = 1 << 23;
/// Least lessons that are kept.
const MIN_LESSONS: usize = 16;

/// Observations, the state before the first, and the f32 network's outputs.
#[derive(Debug)]
pub struct TrainingBatch {
    frames: Array2<f32>,
    state: State,
    /// The f32 network's outputs, `[frame, element]`.
    pub target: Array2<f32>,
}

impl TrainingBatch {
    /// Runs the f32 network on a batch for the network `graph`, whose `states` are those of the episodes.
    pub fn of(windows: &Windows, batch: Batch, graph: &Graph, states: &[State]) -> Self {
        let target = windows.teach(&batch);
        Self { state: batch.state_of(graph, states), frames: batch.frames, target }
    }

    /// Runs a network over the observations.
    pub fn pass(&self, network: &Network<'_>, weights: &Weights) -> crate::graph::Pass {
        network.forward(weights, self.frames.clone(), &mut self.state.clone())
    }

    /// Returns a state of zeros in the form of this one.
    pub fn zero_state(&self) -> State {
        self.state.iter().map(|state| state.each_ref().map(|array| Array2::zeros(array.raw_dim()))).collect()
    }

    fn values(&self) -> usize {
        self.frames.len() + self.target.len()
    }
}

/// The lesson of a part of a batch.
#[derive(Clone, Copy, Debug)]
pub enum Source {
    /// A new lesson, drawn with this seed.
    New(u64),
    /// A kept one.
    Kept(usize),
}

/// The latest lessons.
#[derive(Debug)]
pub struct Lessons {
    kept: Vec<TrainingBatch>,
    /// Parts of batches so far, and new lessons.
    parts: usize,
    drawn: usize,
    random: Random,
}

impl Lessons {
    /// Begins without lessons.
    pub fn new(seed: u64) -> Self {
        Self { kept: Vec::new(), parts: 0, drawn: 0, random: Random::new(seed) }
    }

    /// Returns the sources of the next batch, one for each part.
    pub fn next(&mut self, parts: usize) -> Vec<Source> {
        let mut next = || {
            self.parts += 1;
            // The first batches are new, so that no lesson counts much more often than others.
            if self.kept.len() < MIN_LESSONS || self.parts.is_multiple_of(USES_PER_LESSON) {
                Source::New(self.random.bits())
            } else {
                Source::Kept(self.random.below(self.kept.len()))
            }
        };
        (0..parts).map(|_| next()).collect()
    }

    /// Returns a kept lesson.
    pub fn kept(&self, index: usize) -> &TrainingBatch {
        &self.kept[index]
    }

    /// Keeps a lesson; above the limit, it replaces the oldest one.
    pub fn keep(&mut self, lesson: TrainingBatch) {
        let limit = (MAX_VALUES / lesson.values().max(1)).clamp(MIN_LESSONS, MAX_LESSONS);
        match self.kept.len() < limit {
            true => self.kept.push(lesson),
            false => self.kept[self.drawn % limit] = lesson,
        }
        self.drawn += 1;
    }
}
