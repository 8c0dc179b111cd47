//! Recorded observations, for calibration and held-out measurements. The section Recordings of `docs/QUANTIZER.md`
//! describes the files.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use ndarray::{Array2, Array3, ArrayView1, Axis, s};

use super::arrays::Arrays;
use super::checked::{CheckedArrays, Contents};
use super::sizes::Sizes;
use crate::error::{Context, Result, bail, ensure};
use crate::graph::{Evaluator, Graph};
use crate::import::values::Tensor;
use crate::numbers::square;
use crate::text::count;

/// Episodes of observations, with the f32 policy's own actions if they were recorded.
#[derive(Clone, Debug)]
pub struct Dataset {
    /// File that it was read from, for messages.
    pub path: PathBuf,
    /// `[episode, step, value]`; the noise of an iterative head follows the values of an observation.
    pub obs: Array3<f32>,
    /// `[episode, step, value]`: the network's raw output at that observation.
    pub action: Option<Array3<f32>>,
    /// Valid steps of each episode.
    pub length: Vec<usize>,
    /// `[episode, value]`: the recurrent state before an episode's first step, in the order of [`Graph::state_len`].
    /// Zero if it is absent.
    pub state: Option<Array2<f32>>,
}

/// Largest value that a linear operation may read from a recording: units of any kind stay far below it, and marks for
/// "no reading", as f32's largest number, are above it.
const LARGEST: f32 = 1e30;

impl Dataset {
    /// Reads a recording and checks it against the sizes. Every error names the file and its fault.
    pub fn load(path: &Path, sizes: Sizes) -> Result<Self> {
        let read = || Self::new(path, Arrays::read(path)?, sizes);
        read().with_context(|| path.display().to_string())
    }

    /// Makes a recording of arrays in memory by the rules for a file's arrays. Errors call it `name`.
    pub fn of_arrays(name: &Path, arrays: BTreeMap<String, Tensor>, sizes: Sizes) -> Result<Self> {
        Self::new(name, Arrays::of(arrays), sizes).with_context(|| name.display().to_string())
    }

    fn new(path: &Path, arrays: Arrays, sizes: Sizes) -> Result<Self> {
        let Contents { obs, action, state, length } = CheckedArrays::new(arrays, sizes)?.contents()?;
        Ok(Self { path: path.to_owned(), obs, action, length, state })
    }

    /// Returns the file's name without its folder, for messages.
    pub fn name(&self) -> Cow<'_, str> {
        self.path.file_name().unwrap_or(self.path.as_os_str()).to_string_lossy()
    }

    /// Returns the number of all valid steps.
    pub fn frames(&self) -> usize {
        self.length.iter().sum()
    }

    /// Refuses a recording of fewer than `least` frames; `why` gives the reason.
    pub fn require_frames(&self, least: usize, why: &str) -> Result<()> {
        let frames = self.frames();
        ensure!(
            frames >= least,
            "{}: it has {}, but {least} are needed: {why}",
            self.path.display(),
            count(frames, "frame")
        );
        Ok(())
    }

    /// Returns the observations of an episode, valid steps only.
    pub fn episode(&self, episode: usize) -> impl Iterator<Item = Vec<f32>> + '_ {
        (0..self.length[episode]).map(move |step| self.row(&self.obs, episode, step))
    }

    /// Returns all valid observations, episode after episode.
    pub fn observations(&self) -> impl Iterator<Item = ArrayView1<'_, f32>> {
        let episodes = self.obs.outer_iter().zip(&self.length);
        episodes.flat_map(|(steps, length)| steps.into_outer_iter().take(*length))
    }

    /// Returns the recorded action at a step, if actions were recorded.
    pub fn action_at(&self, episode: usize, step: usize) -> Option<Vec<f32>> {
        Some(self.row(self.action.as_ref()?, episode, step))
    }

    /// Returns the recurrent state before an episode's first step; `None`: zero.
    pub fn start(&self, episode: usize) -> Option<Vec<f32>> {
        Some(self.state.as_ref()?.row(episode).to_vec())
    }

    fn row(&self, array: &Array3<f32>, episode: usize, step: usize) -> Vec<f32> {
        array.index_axis(Axis(0), episode).index_axis(Axis(0), step).to_vec()
    }

    /// Refuses a recording on which the f32 network gives an action that is not finite, or a linear operation reads a
    /// value above [`LARGEST`].
    pub(crate) fn require_finite(&self, graph: &Graph) -> Result<()> {
        let mut evaluator = Evaluator::new(graph);
        for episode in 0..self.length.len() {
            evaluator.start(self.start(episode).as_deref());
            for (step, obs) in self.episode(episode).enumerate() {
                let mut wrong = None;
                let action = evaluator.step(&obs, &mut |matrix, input| {
                    let value = input.iter().find(|value| value.abs() > LARGEST);
                    wrong = wrong.or(value.map(|value| (matrix, *value)));
                });
                let at = || format!("{}: episode {episode}, step {step}", self.path.display());
                let remedy = "leave out the step, or limit its values";
                if let Some(i) = action.iter().position(|value| !value.is_finite()) {
                    bail!("{}: the f32 policy gives {} as action {i}; {remedy}", at(), action[i]);
                }
                if let Some((matrix, value)) = wrong {
                    let name = &graph.matrices[matrix].name;
                    bail!("{}: {name} reads {value:.1e}, which is no measured value; {remedy}", at());
                }
            }
        }
        Ok(())
    }

    /// Fills in the actions of the f32 network if none were recorded.
    pub fn fill_actions(&mut self, graph: &Graph) {
        if self.action.is_some() {
            return;
        }
        let (episodes, steps, _) = self.obs.dim();
        let mut action = Array3::zeros((episodes, steps, graph.len_of(graph.output())));
        let mut evaluator = Evaluator::new(graph);
        for episode in 0..episodes {
            evaluator.start(self.start(episode).as_deref());
            for (step, obs) in self.episode(episode).enumerate() {
                let output = evaluator.step(&obs, &mut |_, _| {});
                action.slice_mut(s![episode, step, ..]).assign(&ArrayView1::from(&output));
            }
        }
        self.action = Some(action);
    }

    /// Returns at most about `most` frames: evenly spaced ones, or, for a `recurrent` policy, the beginnings of evenly
    /// spaced episodes.
    pub fn thinned(&self, most: usize, recurrent: bool) -> Cow<'_, Self> {
        /// Fewer steps describe a recurrent policy badly.
        const STEPS: usize = 64;
        let frames = self.frames();
        if frames <= most {
            return Cow::Borrowed(self);
        }
        let episodes = self.length.len();
        let (obs, action, state, length);
        if recurrent {
            let longest = self.length.iter().copied().max().unwrap_or(0);
            let steps = (most / episodes).max(STEPS).min(longest);
            let count = (most / steps).clamp(1, episodes);
            let chosen: Vec<usize> = (0..count).map(|i| i * episodes / count).collect();
            let part = |array: &Array3<f32>| array.select(Axis(0), &chosen).slice_move(s![.., ..steps, ..]);
            (obs, action) = (part(&self.obs), self.action.as_ref().map(&part));
            state = self.state.as_ref().map(|state| state.select(Axis(0), &chosen));
            length = chosen.iter().map(|&e| self.length[e].min(steps)).collect();
        } else {
            let places: Vec<(usize, usize)> =
                self.length.iter().enumerate().flat_map(|(e, n)| (0..*n).map(move |step| (e, step))).collect();
            let chosen: Vec<(usize, usize)> = (0..most).map(|i| places[i * frames / most]).collect();
            let part = |array: &Array3<f32>| {
                Array3::from_shape_fn((1, most, array.dim().2), |(_, i, v)| array[[chosen[i].0, chosen[i].1, v]])
            };
            (obs, action) = (part(&self.obs), self.action.as_ref().map(&part));
            (state, length) = (None, vec![most]);
        }
        Cow::Owned(Self { path: self.path.clone(), obs, action, length, state })
    }
}

/// Returns the mean and the variance of each of the `values` in rows; zeros without rows. The sums are in f64, in the
/// order of the rows.
pub(crate) fn mean_and_variance<'a, R: Iterator<Item = ArrayView1<'a, f32>>>(
    values: usize,
    rows: impl Fn() -> R,
) -> (Vec<f64>, Vec<f64>) {
    let count = rows().count().max(1) as f64;
    let mean_of = |f: &dyn Fn(usize, f64) -> f64| -> Vec<f64> {
        let mut sums = vec![0.0; values];
        for row in rows() {
            sums.iter_mut().zip(row).enumerate().for_each(|(i, (sum, v))| *sum += f(i, f64::from(*v)));
        }
        sums.into_iter().map(|sum| sum / count).collect()
    };
    let mean = mean_of(&|_, v| v);
    let variance = mean_of(&|i, v| square(v - mean[i]));
    (mean, variance)
}
