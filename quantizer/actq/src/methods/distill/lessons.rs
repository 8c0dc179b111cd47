//! Batches with the f32 network's answers. The f32 network is often larger than the one that learns, so each of its
//! answers is learned from several times, in different company.

use ndarray::Array2;

use crate::calibrate::windows::{Batch, Windows};
use crate::graph::{Graph, Network, State, Weights};
use crate::random::Random;

/// Times that an answer is learned from, on average.
const USES: usize = 4;
/// Most lessons that are kept, and most values in all of them.
const KEPT: usize = 256;
const VALUES: usize = 1 << 23;
/// Least lessons that are kept.
const LEAST_KEPT: usize = 16;

/// Observations, the state before the first, and the f32 network's outputs.
#[derive(Debug)]
pub struct Lesson {
    frames: Array2<f32>,
    state: State,
    /// The f32 network's outputs, `[frame, element]`.
    pub target: Array2<f32>,
}

impl Lesson {
    /// Asks the f32 network about a batch for the network `graph`, whose `states` are those of the episodes.
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

/// The lessons of late.
#[derive(Debug)]
pub struct Lessons {
    kept: Vec<Lesson>,
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
            if self.kept.len() < LEAST_KEPT || self.parts.is_multiple_of(USES) {
                Source::New(self.random.bits())
            } else {
                Source::Kept(self.random.below(self.kept.len()))
            }
        };
        (0..parts).map(|_| next()).collect()
    }

    /// Returns a kept lesson.
    pub fn kept(&self, index: usize) -> &Lesson {
        &self.kept[index]
    }

    /// Keeps a lesson, in place of the oldest one if there are enough.
    pub fn keep(&mut self, lesson: Lesson) {
        let room = (VALUES / lesson.values().max(1)).clamp(LEAST_KEPT, KEPT);
        match self.kept.len() < room {
            true => self.kept.push(lesson),
            false => self.kept[self.drawn % room] = lesson,
        }
        self.drawn += 1;
    }
}
