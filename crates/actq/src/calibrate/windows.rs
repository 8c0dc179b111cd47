//! Batches of recorded observations: single frames for a feed-forward network, windows with the f32 network's own state
//! at their start for a recurrent one.

use ndarray::{Array2, ArrayView2, Axis, s};
use rayon::prelude::*;

use super::imagined::{Imagined, Recorded, Rollout};
use super::widening::{MEMORY, Widening};
use crate::data::{Dataset, mean_and_variance};
use crate::graph::{Graph, Network, State, Weights, copy_sample, start_state, zero_state};
use crate::numbers::power;
use crate::random::Random;

/// Steps of a recurrent network's window.
const WINDOW: usize = 64;
/// Frames of a feed-forward network that run at once, so that their values stay in the cache.
const ROWS: usize = 32;
/// Share of the windows that start from the zero state, wherever they are.
const FROM_ZERO: f32 = 0.15;
/// Episodes that a thread runs at once.
const EPISODES: usize = 8;
/// One episode in this many is held out to measure choices.
const HELD_OUT: usize = 4;

/// A batch of windows: observations, and the state before the first step.
#[derive(Clone, Debug)]
pub struct Batch {
    /// `[frame, element]`: the first step of every window, then the second step of every window, and so on.
    pub frames: Array2<f32>,
    /// The f32 network's state before the first step.
    pub state: State,
    /// Episode and step that each window of a recurrent network begins at; `None`: at the zero state.
    pub starts: Vec<Option<(usize, usize)>>,
}

impl Batch {
    /// Returns the state before the first step of another network, whose `states` are those of the episodes.
    pub fn state_of(&self, graph: &Graph, states: &[State]) -> State {
        let mut state = zero_state(graph, self.starts.len());
        for (sample, start) in self.starts.iter().enumerate() {
            let Some((episode, step)) = *start else { continue };
            copy_sample(&states[episode], step, &mut state, sample);
        }
        state
    }
}

/// The f32 network and its recorded observations.
#[derive(Debug)]
pub struct Windows {
    /// The f32 network.
    pub graph: Graph,
    /// Its weights.
    pub weights: Weights,
    /// Valid observations of each episode, `[step, element]`, at least as many as a window has.
    episodes: Vec<Array2<f32>>,
    /// State before each step of each episode, one row a step; empty for a feed-forward network.
    states: Vec<State>,
    /// Standard deviation of each observation value.
    deviation: Vec<f32>,
    /// Variance of each output of the f32 network over the recording.
    pub output_variance: Vec<f32>,
    /// Steps of a window.
    pub window: usize,
    /// Imagined rollouts, which some of the widened windows are taken from.
    pub imagined: Option<Imagined>,
}

impl Windows {
    /// Runs the f32 network over the recording. If frames do not depend on each other, it uses one in `every` frames,
    /// and the outputs' variance covers these.
    pub fn new(graph: Graph, dataset: &Dataset, every: usize) -> Self {
        let weights = Weights::of(&graph);
        let network = Network::new(&graph);
        let recurrent = graph.state_len() > 0;
        let length = |e: usize| dataset.length[e];
        let recorded: Vec<usize> = (0..dataset.length.len()).filter(|&e| length(e) > 0).collect();
        let shaped = |&e: &usize| {
            let rows: Vec<f32> = dataset.episode(e).flatten().collect();
            Array2::from_shape_vec((length(e), graph.input_len()), rows).unwrap_or_default()
        };
        let mut episodes: Vec<Array2<f32>> = recorded.iter().map(shaped).collect();
        let (mut states, mut outputs) = (Vec::new(), Vec::new());
        if recurrent {
            for (&e, episode) in recorded.iter().zip(&episodes) {
                let mut state = start_state(&graph, &[dataset.start(e)]);
                let mut kept = zero_state(&graph, length(e));
                for (t, obs) in episode.axis_chunks_iter(Axis(0), 1).enumerate() {
                    copy_sample(&state, 0, &mut kept, t);
                    outputs.push(network.forward(&weights, obs.to_owned(), &mut state).output().clone());
                }
                states.push(kept);
            }
        } else {
            let of_some = |some: ArrayView2<'_, f32>| {
                let mut state = zero_state(&graph, some.nrows());
                network.forward(&weights, some.to_owned(), &mut state).into_output()
            };
            let of_episode = |episode: &Array2<f32>| -> Vec<Array2<f32>> {
                episode.slice(s![..;every, ..]).axis_chunks_iter(Axis(0), ROWS).map(of_some).collect()
            };
            outputs = episodes.par_iter().flat_map_iter(of_episode).collect();
        }
        let deviation = column_variances(&episodes).into_iter().map(root).collect();
        let output_variance = column_variances(&outputs).into_iter().map(|v| v as f32).collect();
        let longest = episodes.iter().map(Array2::nrows).max().unwrap_or(1);
        let window = if recurrent { WINDOW.min(longest) } else { 1 };
        for episode in &mut episodes {
            last(episode, window);
        }
        Self { graph, weights, states, deviation, output_variance, episodes, window, imagined: None }
    }

    /// Adds imagined rollouts. Denoising heads have none: their answers depend on the noise, too.
    pub fn imagine(&mut self, seed: u64) {
        let Self { graph, weights, episodes, states, window, .. } = &*self;
        if graph.denoising.is_none() {
            self.imagined = Recorded { graph, weights, episodes, states, window: *window }.imagine(seed);
        }
    }

    /// Returns `true` if steps depend on each other.
    pub fn recurrent(&self) -> bool {
        !self.states.is_empty()
    }

    /// Returns the frames of all episodes.
    pub fn frames(&self) -> usize {
        self.episodes.iter().map(Array2::nrows).sum()
    }

    fn row(&self, random: &mut Random) -> ndarray::ArrayView1<'_, f32> {
        let episode = &self.episodes[random.below(self.episodes.len())];
        episode.row(random.below(episode.nrows()))
    }

    /// Replaces the network by another one with the same outputs and the same states in the same order.
    pub fn with(self, graph: Graph) -> Self {
        let moved = |state: State| {
            let mut moved = zero_state(&graph, 0);
            let mut from = state.into_iter().flatten().filter(|of| of.ncols() > 0);
            for to in moved.iter_mut().flatten().filter(|to| to.ncols() > 0) {
                *to = from.next().unwrap_or_default();
            }
            moved
        };
        let states = self.states.into_iter().map(moved).collect();
        Self { weights: Weights::of(&graph), states, graph, ..self }
    }

    /// Draws a batch of `size` windows, at the recorded observations or widened.
    pub fn batch(&self, size: usize, widening: Option<Widening>, random: &mut Random) -> Batch {
        let mut frames = Array2::zeros((size * self.window, self.graph.input_len()));
        let mut starts = Vec::with_capacity(size);
        for sample in 0..size {
            // `origin`: step of the recorded episode that the source begins at.
            let (episode, origin, source) = match widening.and_then(|_| self.imagined.as_ref()?.draw(random)) {
                Some(Rollout { episode, start, frames }) => (*episode, *start, frames),
                None => {
                    let episode = random.below(self.episodes.len());
                    (episode, 0, &self.episodes[episode])
                }
            };
            let start = random.below(source.nrows() + 1 - self.window);
            for t in 0..self.window {
                frames.row_mut(t * size + sample).assign(&source.row(start + t));
            }
            let mut from_zero = false;
            if let Some(widening) = widening {
                self.widen(widening, (0..self.window).map(|t| t * size + sample), &mut frames, random);
                from_zero = random.share() < FROM_ZERO;
            }
            starts.push((self.recurrent() && !from_zero).then_some((episode, origin + start)));
        }
        let mut batch = Batch { frames, state: State::new(), starts };
        batch.state = batch.state_of(&self.graph, &self.states);
        batch
    }

    /// Runs a recurrent network over the episodes, from the f32 network's first states if `graph` has as many values;
    /// returns its states before each step.
    pub fn states_of(&self, network: &Network<'_>, weights: &Weights) -> Vec<State> {
        let episodes: Vec<(&Array2<f32>, &State)> = self.episodes.iter().zip(&self.states).collect();
        let of_some = |episodes: &[(&Array2<f32>, &State)]| states_of(network, weights, episodes);
        episodes.par_chunks(EPISODES).flat_map_iter(of_some).collect()
    }

    /// Adds noise to the window in these rows of `frames`.
    fn widen(
        &self,
        widening: Widening,
        rows: impl Iterator<Item = usize>,
        frames: &mut Array2<f32>,
        random: &mut Random,
    ) {
        let mut shift = vec![0.0; self.graph.obs_len];
        // Half of the windows keep their place.
        let share = widening.mix * random.unit().max(0.0);
        if share > 0.0 {
            let (a, b) = (self.row(random), self.row(random));
            shift.iter_mut().zip(a.iter().zip(b)).for_each(|(s, (a, b))| *s = share * (a - b));
        }
        let amplitude = widening.noise * power(random.share(), widening.power);
        let fresh = (1.0 - MEMORY * MEMORY).sqrt();
        let mut noise: Vec<f32> = (0..self.graph.obs_len).map(|_| random.normal()).collect();
        for row in rows {
            let values = frames.row_mut(row).into_iter().zip(&self.deviation).zip(shift.iter().zip(&mut noise));
            for ((x, deviation), (shift, noise)) in values {
                *x += shift + amplitude * deviation * *noise;
                *noise = MEMORY * *noise + fresh * random.normal();
            }
            // Draw the denoising noise anew, since the policy may begin from anything.
            frames.slice_mut(s![row, self.graph.obs_len..]).iter_mut().for_each(|noise| *noise = random.normal());
        }
    }

    /// Splits the windows into those of three in four episodes and those of the others; `None` if there are too few.
    pub fn split(&self) -> Option<(Self, Self)> {
        let part = |is_held_out: bool| {
            let of = |e: &usize| (e % HELD_OUT == HELD_OUT - 1) == is_held_out;
            let chosen: Vec<usize> = (0..self.episodes.len()).filter(of).collect();
            (!chosen.is_empty()).then(|| Self {
                graph: self.graph.clone(),
                weights: self.weights.clone(),
                episodes: chosen.iter().map(|&e| self.episodes[e].clone()).collect(),
                states: chosen.iter().filter_map(|&e| self.states.get(e).cloned()).collect(),
                deviation: self.deviation.clone(),
                output_variance: self.output_variance.clone(),
                window: self.window,
                imagined: self.imagined.as_ref().map(|imagined| imagined.beside(&chosen)),
            })
        };
        Some((part(false)?, part(true)?))
    }

    /// Returns the f32 network's outputs on a batch, `[frame, element]`.
    pub fn teach(&self, batch: &Batch) -> Array2<f32> {
        let mut state = batch.state.clone();
        Network::new(&self.graph).forward(&self.weights, batch.frames.clone(), &mut state).into_output()
    }

    /// Draws a batch, and runs the f32 network on it.
    pub fn taught_batch(
        &self,
        samples: usize,
        widening: Option<Widening>,
        random: &mut Random,
    ) -> (Batch, Array2<f32>) {
        let batch = self.batch(samples, widening, random);
        let target = self.teach(&batch);
        (batch, target)
    }
}

/// Runs a network over some episodes at once; returns its states before each step.
fn states_of(network: &Network<'_>, weights: &Weights, episodes: &[(&Array2<f32>, &State)]) -> Vec<State> {
    let graph = network.graph;
    let mut state = zero_state(graph, episodes.len());
    for (i, (_, first)) in episodes.iter().enumerate() {
        copy_sample(first, 0, &mut state, i);
    }
    let mut states: Vec<State> = episodes.iter().map(|(episode, _)| zero_state(graph, episode.nrows())).collect();
    let longest = episodes.iter().map(|(episode, _)| episode.nrows()).max().unwrap_or(0);
    for t in 0..longest {
        for (i, kept) in states.iter_mut().enumerate().filter(|(i, _)| t < episodes[*i].0.nrows()) {
            copy_sample(&state, i, kept, t);
        }
        let row = |i: usize| episodes[i].0.row(t.min(episodes[i].0.nrows() - 1));
        let frames = Array2::from_shape_fn((episodes.len(), graph.input_len()), |(i, c)| row(i)[c]);
        network.forward(weights, frames, &mut state);
    }
    states
}

/// Repeats the last observation until the episode has `steps` steps, so that a short episode, at whose end a robot may
/// have fallen, does not shorten all windows. The f32 network is evaluated there, too.
fn last(episode: &mut Array2<f32>, steps: usize) {
    let there = episode.nrows();
    if there < steps {
        *episode = Array2::from_shape_fn((steps, episode.ncols()), |(t, i)| episode[[t.min(there - 1), i]]);
    }
}

/// Returns the variance of every column over all rows of all arrays.
fn column_variances(arrays: &[Array2<f32>]) -> Vec<f64> {
    let cols = arrays.first().map_or(0, Array2::ncols);
    mean_and_variance(cols, || arrays.iter().flat_map(|array| array.rows())).1
}

/// Returns the root of a variance as f32, with the same digits in any unit: f32 holds no squares from 1e20 on.
fn root(variance: f64) -> f32 {
    let unit = libm::exp2((0.5 * libm::log2(variance.max(f64::MIN_POSITIVE))).trunc());
    ((variance / (unit * unit)) as f32).sqrt() * unit as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{dataset, driven, lstm, mlp};

    #[test]
    fn short_episodes_do_not_shorten_windows() {
        let graph = lstm();
        let mut dataset = dataset(&graph, 2, 80);
        dataset.length[1] = 5;
        let windows = Windows::new(graph.clone(), &dataset, 1);
        assert_eq!((windows.window, windows.episodes[0].nrows(), windows.episodes[1].nrows()), (WINDOW, 80, WINDOW));
        assert_eq!(windows.episodes[1].row(4), windows.episodes[1].row(63));
        assert_ne!(windows.episodes[1].row(3), windows.episodes[1].row(4));
        let batch = windows.batch(8, None, &mut Random::new(1));
        assert_eq!(windows.teach(&batch).nrows(), 8 * WINDOW);
    }

    #[test]
    fn deviations_have_equal_digits_in_every_unit() {
        for variance in [0.0f64, 0.3, 1.0, 7.9e4] {
            let deviation = root(variance);
            assert_eq!(deviation, (variance as f32).sqrt());
            for unit in [-66, 66].map(|n| 2f64.powi(n)) {
                assert_eq!(root(variance * unit * unit), deviation * unit as f32);
            }
        }
    }

    #[test]
    fn some_widened_windows_are_imagined() {
        const STILL: Widening = Widening { noise: 0.0, power: 1, mix: 0.0 };
        let (graph, frames) = (mlp(), 1000);
        let dataset = driven(&graph, 4, 120);
        let mut windows = Windows::new(graph, &dataset, 1);
        windows.imagine(1);
        let recorded = |widening| {
            let batch = windows.batch(frames, widening, &mut Random::new(2));
            let is_recorded = |frame: &ndarray::ArrayView1<'_, f32>| {
                windows.episodes.iter().any(|episode| episode.rows().into_iter().any(|row| row == frame))
            };
            batch.frames.rows().into_iter().filter(is_recorded).count()
        };
        assert_eq!(recorded(None), frames);
        let imagined = windows.imagined.as_ref().expect("a model");
        let expected = (1.5 - imagined.predicted) * frames as f64;
        let found = recorded(Some(STILL)) as f64;
        assert!((found - expected).abs() < 60.0, "{found} recorded frames, not {expected}");
    }
}
