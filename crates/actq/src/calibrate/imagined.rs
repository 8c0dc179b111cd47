//! Imagined rollouts: where a robot goes if its policy's answers are a little wrong, or its task is another one.
//!
//! The errors of a small network lead its robot to places that the recording of the f32 policy does not have. Noise on
//! single values does not lead there, because the values of an observation depend on each other. So a linear model of
//! the robot (`dynamics.rs`) is fitted to the recording. A rollout begins beside a recorded observation, and the
//! difference `e` to the recording goes on by the model, in units of deviations:
//!
//! `e' = A e + B (policy(x + e) + error - policy(x)) + residual`
//!
//! `x` is the recorded observation, `policy` the f32 network, `error` a noise that lasts for some steps, and `residual`
//! a part of what the model did not predict at some recorded step. Of what happens along the recorded episode, such as
//! the contacts of feet, the model has to predict nothing.
//!
//! Short branches from recorded states are those of Dyna (Sutton 1991) and MBPO (Janner et al., arXiv 1906.08253). That
//! the f32 policy answers where the errors lead is DAgger (Ross, Gordon, Bagnell 2011), here without a simulator; noise
//! on the expert's answers is DART's (Laskey et al., arXiv 1703.09327). Figures: docs/records/2026-11-27-imagined.md.

use ndarray::{Array2, ArrayView1, ArrayViewMut1};

use super::dynamics::Dynamics;
use crate::graph::{Graph, Network, State, Weights, copy_sample, zero_state};
use crate::random::Random;

/// Most steps of a feed-forward network's rollout; that of a recurrent one is a whole window.
const STEPS: usize = 50;
/// Most observations of all rollouts, and most multiplications for them.
const MAX_FRAMES: usize = 32_768;
const MAX_MULTIPLICATIONS: u64 = 1 << 34;
/// Most values of an observation and an answer together; the time of the fit grows with their cube.
const MAX_VALUES: usize = 1_024;
/// Share of the next observation's variance above which the model's rollouts are learned from. What it predicts beyond
/// that is their share of the widened windows: at most half of them.
const MIN_PREDICTED: f64 = 0.5;
/// Largest share of the difference of two recorded observations that a rollout begins beside the recording.
const LARGEST_SHIFT: f32 = 0.5;
/// Deviation of the answers' errors, in deviations of the answers, and the share of a residual that is added. A
/// recurrent policy keeps its balance with less (docs/records/2026-11-27-imagined.md).
const OF_FRAMES: Disturbance = Disturbance { error: 0.5, residual: 0.5 };
const OF_WINDOWS: Disturbance = Disturbance { error: 0.25, residual: 0.25 };
/// Share of an answer's error that remains from step to step.
const MEMORY: f32 = 0.9;
/// Largest difference of a value to the recording, in deviations. A rollout ends before a larger one: the model is not
/// valid there.
const MAX_DIFFERENCE: f32 = 6.0;

/// A rollout.
#[derive(Clone, Debug)]
pub(super) struct Rollout {
    /// Recorded episode and step that it begins beside.
    pub(super) episode: usize,
    pub(super) start: usize,
    /// Observations, `[step, value]`.
    pub(super) frames: Array2<f32>,
}

/// Imagined rollouts of a recording.
#[derive(Debug)]
pub struct Imagined {
    pub(super) rollouts: Vec<Rollout>,
    /// Share of the next observation's variance that the model predicts in episodes that it was not fitted to.
    pub predicted: f64,
}

impl Imagined {
    /// Returns the rollouts beside some of the recorded episodes, which are numbered anew.
    pub(super) fn beside(&self, episodes: &[usize]) -> Self {
        let renumbered = |rollout: &Rollout| {
            let episode = episodes.iter().position(|episode| *episode == rollout.episode)?;
            Some(Rollout { episode, ..rollout.clone() })
        };
        Self { rollouts: self.rollouts.iter().filter_map(renumbered).collect(), ..*self }
    }

    /// Draws the rollout of a widened window; `None` for a recorded one.
    pub(super) fn draw(&self, random: &mut Random) -> Option<&Rollout> {
        let share = (self.predicted - MIN_PREDICTED) as f32;
        let is_imagined = !self.rollouts.is_empty() && random.share() < share;
        is_imagined.then(|| &self.rollouts[random.below(self.rollouts.len())])
    }

    /// Returns the observations of all rollouts.
    pub fn frames(&self) -> usize {
        self.rollouts.iter().map(|rollout| rollout.frames.nrows()).sum()
    }
}

/// A recording with its f32 network, which takes no noise.
#[derive(Clone, Copy, Debug)]
pub(super) struct Recorded<'a> {
    pub(super) graph: &'a Graph,
    pub(super) weights: &'a Weights,
    /// Observations of each episode, `[step, value]`.
    pub(super) episodes: &'a [Array2<f32>],
    /// State before each step of each episode; empty for a feed-forward network.
    pub(super) states: &'a [State],
    /// Steps of a recurrent network's window.
    pub(super) window: usize,
}

impl Recorded<'_> {
    /// Imagines rollouts. There are none if the model does not predict the next observation, as where frames are not
    /// successive steps. `None` if there is no model: without steps, or for very long observations.
    pub(super) fn imagine(self, seed: u64) -> Option<Imagined> {
        let values = self.graph.obs_len + self.graph.len_of(self.graph.output());
        if values > MAX_VALUES {
            return None;
        }
        let answers: Vec<Array2<f32>> = (0..self.episodes.len()).map(|episode| self.answers(episode)).collect();
        let model = Dynamics::fit(self.episodes, &answers)?;
        let predicted = model.predicted;
        let rollouts = match predicted > MIN_PREDICTED {
            true => self.rollouts(&model, &answers, &mut Random::new(seed)),
            false => Vec::new(),
        };
        Some(Imagined { rollouts, predicted })
    }

    fn is_recurrent(&self) -> bool {
        !self.states.is_empty()
    }

    /// Returns the answers to an episode.
    fn answers(&self, episode: usize) -> Array2<f32> {
        let observations = &self.episodes[episode];
        let mut state = match self.states.get(episode) {
            Some(states) => states.clone(),
            None => zero_state(self.graph, observations.nrows()),
        };
        Network::new(self.graph).forward(self.weights, observations.clone(), &mut state).into_output()
    }

    /// Makes all rollouts side by side.
    fn rollouts(&self, model: &Dynamics, answers: &[Array2<f32>], random: &mut Random) -> Vec<Rollout> {
        let Self { graph, weights, episodes, states, window } = *self;
        let is_recurrent = self.is_recurrent();
        let longest = episodes.iter().map(Array2::nrows).max().unwrap_or(0);
        let steps = if is_recurrent { window } else { STEPS.min(longest) };
        let work = graph.obs_len * (model.observation.len() + model.answer.len()) + graph.weights();
        let affordable = usize::try_from(MAX_MULTIPLICATIONS / work.max(1) as u64).unwrap_or(usize::MAX);
        let count = MAX_FRAMES.min(affordable) / steps.max(1);
        let mut branches: Vec<Branch> = (0..count).map(|_| Branch::draw(self, model, steps, random)).collect();
        let mut state = zero_state(graph, count);
        for (sample, branch) in branches.iter().enumerate().filter(|_| is_recurrent) {
            copy_sample(&states[branch.episode], branch.start, &mut state, sample);
        }
        for step in 0..steps {
            let mut frames = Array2::zeros((count, graph.obs_len));
            for (branch, mut frame) in branches.iter_mut().zip(frames.rows_mut()) {
                branch.observe(model, row(&episodes[branch.episode], branch.start + step), frame.view_mut());
                branch.keep(step, frame.view());
            }
            let given = Network::new(graph).forward(weights, frames, &mut state).into_output();
            let mut differences = Array2::zeros((count, model.observation.len() + model.answer.len()));
            for ((branch, to), given) in branches.iter_mut().zip(differences.rows_mut()).zip(given.rows()) {
                branch.err(random);
                let recorded = row(&answers[branch.episode], branch.start + step);
                branch.write_differences(model, given, recorded, to);
            }
            let next = model.next(differences.view());
            for (branch, next) in branches.iter_mut().zip(next.rows()) {
                branch.advance(model, next, model.residuals.row(random.below(model.residuals.nrows())));
            }
        }
        branches.into_iter().filter_map(|branch| branch.rollout(if is_recurrent { steps } else { 1 })).collect()
    }
}

/// Returns the row of a step; the last one after the end.
fn row(rows: &Array2<f32>, step: usize) -> ArrayView1<'_, f32> {
    rows.row(step.min(rows.nrows() - 1))
}

/// Sizes of the disturbances that lead a rollout off the recording.
#[derive(Clone, Copy, Debug)]
struct Disturbance {
    error: f32,
    residual: f32,
}

/// A rollout in the making.
struct Branch {
    episode: usize,
    start: usize,
    /// Steps until the recorded episode ends.
    steps: usize,
    /// Difference to the recorded observation and error of the answer, in deviations.
    difference: Vec<f32>,
    error: Vec<f32>,
    disturbance: Disturbance,
    /// Observations so far, one after the other.
    frames: Vec<f32>,
    is_over: bool,
}

impl Branch {
    /// Begins beside a recorded observation. A recurrent network's begins early enough for all `steps`, because its
    /// windows are whole.
    fn draw(recorded: &Recorded<'_>, model: &Dynamics, steps: usize, random: &mut Random) -> Self {
        let episodes = recorded.episodes;
        let episode = random.below(episodes.len());
        let there = episodes[episode].nrows();
        let start = random.below(if recorded.is_recurrent() { there + 1 - steps } else { there });
        let mut any = || {
            let episode = &episodes[random.below(episodes.len())];
            row(episode, random.below(episode.nrows()))
        };
        let (from, to) = (any(), any());
        let share = LARGEST_SHIFT * random.share();
        let disturbance = if recorded.is_recurrent() { OF_WINDOWS } else { OF_FRAMES };
        let values = to.iter().zip(from).zip(&model.observation);
        Self {
            episode,
            start,
            steps: steps.min(there - start),
            difference: values.map(|((to, from), unit)| in_units(share * (to - from), *unit)).collect(),
            error: model.answer.iter().map(|_| disturbance.error * random.normal()).collect(),
            disturbance,
            frames: Vec::new(),
            is_over: false,
        }
    }

    /// Writes the observation beside the recorded one.
    fn observe(&self, model: &Dynamics, recorded: ArrayView1<'_, f32>, mut to: ArrayViewMut1<'_, f32>) {
        let differences = self.difference.iter().zip(&model.observation);
        for ((to, recorded), (difference, unit)) in to.iter_mut().zip(recorded).zip(differences) {
            *to = recorded + unit * difference;
        }
    }

    /// Appends an observation to the rollout.
    fn keep(&mut self, step: usize, observation: ArrayView1<'_, f32>) {
        if step < self.steps && !self.is_over {
            self.frames.extend(observation);
        }
    }

    /// Draws the next error of the answer.
    fn err(&mut self, random: &mut Random) {
        let fresh = self.disturbance.error * (1.0 - MEMORY * MEMORY).sqrt();
        self.error.iter_mut().for_each(|error| *error = MEMORY * *error + fresh * random.normal());
    }

    /// Writes the differences of the observation and of the answer with its error.
    fn write_differences(
        &self,
        model: &Dynamics,
        given: ArrayView1<'_, f32>,
        recorded: ArrayView1<'_, f32>,
        to: ArrayViewMut1<'_, f32>,
    ) {
        let answers = given.iter().zip(recorded).zip(self.error.iter().zip(&model.answer));
        let of_answers = answers.map(|((given, recorded), (error, unit))| match *unit > 0.0 {
            true => in_units(given - recorded, *unit) + error,
            false => 0.0,
        });
        to.into_iter().zip(self.difference.iter().copied().chain(of_answers)).for_each(|(to, value)| *to = value);
    }

    /// Goes on to the next step.
    fn advance(&mut self, model: &Dynamics, next: ArrayView1<'_, f32>, residual: ArrayView1<'_, f32>) {
        let next = next.iter().zip(residual).zip(&model.observation);
        let share = self.disturbance.residual;
        let next = next.map(|((next, residual), unit)| if *unit > 0.0 { next + share * residual } else { 0.0 });
        self.difference = next.collect();
        self.is_over |= !self.difference.iter().all(|difference| difference.abs() <= MAX_DIFFERENCE);
        if self.is_over {
            self.difference.fill(0.0);
        }
    }

    /// Returns the rollout if it has at least `least` steps.
    fn rollout(self, least: usize) -> Option<Rollout> {
        let Self { episode, start, frames, difference, .. } = self;
        let steps = frames.len() / difference.len().max(1);
        let frames = Array2::from_shape_vec((steps, difference.len()), frames).ok()?;
        (steps >= least).then_some(Rollout { episode, start, frames })
    }
}

/// Returns a value in a unit; 0 for a value that does not change, whose unit is 0.
fn in_units(value: f32, unit: f32) -> f32 {
    if unit > 0.0 { value / unit } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::Dataset;
    use crate::testing::{dataset, driven, lstm, mlp};

    /// Calls `of` with a recording and its f32 network.
    fn with<R>(graph: &Graph, dataset: &Dataset, of: impl FnOnce(Recorded<'_>) -> R) -> R {
        let weights = Weights::of(graph);
        let of_episode = |e: usize| {
            let rows: Vec<f32> = dataset.episode(e).flatten().collect();
            Array2::from_shape_vec((dataset.length[e], graph.obs_len), rows).expect("whole rows")
        };
        let episodes: Vec<Array2<f32>> = (0..dataset.length.len()).map(of_episode).collect();
        let states = match graph.state_len() {
            0 => Vec::new(),
            _ => episodes.iter().map(|episode| zero_state(graph, episode.nrows())).collect(),
        };
        of(Recorded { graph, weights: &weights, episodes: &episodes, states: &states, window: 16 })
    }

    #[test]
    fn rollouts_keep_what_values_have_in_common() {
        let graph = mlp();
        let dataset = driven(&graph, 4, 120);
        let Imagined { rollouts, predicted } =
            with(&graph, &dataset, |recorded| recorded.imagine(1)).expect("a model of the robot");
        assert!(predicted > MIN_PREDICTED, "{predicted}");
        let (mut steps, mut moved) = (0, 0.0f32);
        for Rollout { episode, start, frames } in &rollouts {
            assert!(start + frames.nrows() <= 120 && frames.nrows() <= STEPS);
            for t in 1..frames.nrows() {
                // The last value is the first one of the step before: the model has learned it, up to its ridge.
                let difference =
                    |step: usize, value: usize| frames[[step, value]] - dataset.obs[(*episode, start + step, value)];
                let (here, before) = (difference(t, 2), difference(t - 1, 0));
                assert!((here - before).abs() < 0.05, "{here} after {before}");
                moved += before.abs();
                steps += 1;
            }
        }
        assert!(steps > 10_000 && moved / steps as f32 > 0.05, "{steps} steps, moved by {moved} in all");
    }

    #[test]
    fn equal_seeds_give_equal_rollouts() {
        let graph = mlp();
        let dataset = driven(&graph, 4, 60);
        let of_seed = |seed: u64| with(&graph, &dataset, |recorded| recorded.imagine(seed)).expect("a model").rollouts;
        let [a, b, other] = [1, 1, 2].map(of_seed);
        assert!(a.iter().zip(&b).all(|(a, b)| a.frames == b.frames));
        assert!(a.iter().zip(&other).any(|(a, other)| a.frames != other.frames));
    }

    #[test]
    fn random_frames_have_no_rollouts() {
        let graph = mlp();
        let imagined = with(&graph, &dataset(&graph, 4, 60), |recorded| recorded.imagine(1)).expect("a model");
        assert!(imagined.predicted < MIN_PREDICTED && imagined.frames() == 0, "{imagined:?}");
        assert!((0..20).all(|seed| imagined.draw(&mut Random::new(seed)).is_none()));
    }

    #[test]
    fn rollouts_of_recurrent_networks_are_whole_windows() {
        let graph = lstm();
        let imagined = with(&graph, &driven(&graph, 5, 40), |recorded| recorded.imagine(1)).expect("a model");
        assert!(!imagined.rollouts.is_empty());
        assert!(imagined.rollouts.iter().all(|rollout| rollout.frames.nrows() == 16 && rollout.start <= 40 - 16));
        let beside = imagined.beside(&[4, 1]);
        assert!(beside.rollouts.iter().all(|rollout| rollout.episode < 2));
        let of = |episode: usize| imagined.rollouts.iter().filter(|rollout| rollout.episode == episode).count();
        assert_eq!(beside.rollouts.len(), of(4) + of(1));
    }
}
