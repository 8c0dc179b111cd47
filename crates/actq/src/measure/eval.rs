//! Errors of an image's actions against the f32 policy's.

use std::ops::Range;
use std::path::Path;

use actq_kernels::{Head, Image};
use serde::{Deserialize, Serialize};

use super::recorded::{self, Difference};
use super::size::bits_per_weight;
use super::unrounded::Unrounded;
use crate::data::{Dataset, Recording, Sizes};
use crate::error::{Context, Result, ensure};
use crate::graph::{Evaluator, Graph};
use crate::numbers::square;
use crate::policy::Policy;
use crate::runtime::{take_prefix, with_head};
use crate::text::count;

/// Errors of the raw network output against recorded f32 actions.
#[derive(Clone, Debug, Serialize)]
pub struct ErrorReport {
    /// Normalized mean squared error: mean over the output's dimensions of (mean squared error / variance of the
    /// recorded values).
    pub nmse: f64,
    /// Largest ratio of a dimension.
    pub worst_nmse: f64,
    /// Largest absolute error, in units of the raw output.
    pub max_abs: f64,
    /// Compared observations.
    pub steps: usize,
    /// Bits per weight of the matrices, with scales and padding; biases and header do not count.
    pub bpw: f64,
    /// Bytes of the image.
    pub bytes: usize,
    /// Output dimension of `worst_nmse`.
    #[serde(skip)]
    pub worst_dimension: usize,
}

/// Runs `image` over the valid steps of `dataset`, each episode from its starting state, and compares its raw output
/// with the recorded actions. Dimensions that never vary in the recording do not count.
pub fn evaluate(image: Image<'_>, dataset: &Dataset) -> Result<ErrorReport> {
    with_head(image, |head| compare(&image, dataset, head))
}

/// Returns the NMSE of a network in f32 over `dataset`, comparable to [`ErrorReport::nmse`].
pub fn network_nmse(graph: &Graph, dataset: &Dataset) -> Result<f64> {
    let mut network = Plain { evaluator: Evaluator::new(graph), output: Vec::new() };
    let sums = ErrorSums::over(graph.len_of(graph.output()), dataset, 0..dataset.length.len(), &mut network)?;
    Ok(sums.differences(&dataset.path)?.nmse)
}

/// Error that rounding the activations adds to an image.
#[derive(Clone, Debug)]
pub struct ActivationShare {
    /// Share of the image's error that disappears with activations in f32; below 0 if rounding the activations happens
    /// to help.
    pub share: f64,
    /// Linear operations, counted from 0, whose input is rounded to more than int8.
    pub int16: Vec<usize>,
    /// Number of linear operations.
    pub linear: usize,
}

/// Runs the image's weights with activations in f32 over `dataset`; `nmse` is the error of the image itself.
pub fn activation_share(image: Image<'_>, dataset: &Dataset, nmse: f64) -> Result<ActivationShare> {
    let unrounded_nmse = compare(&image, dataset, &mut Unrounded::new(image))?.nmse;
    let limits: Vec<u16> = image.ops().filter_map(|op| op.matrix()).map(|matrix| matrix.x_max).collect();
    let share = if nmse > 0.0 { (nmse - unrounded_nmse) / nmse } else { 0.0 };
    let int16 = (0..limits.len()).filter(|&i| limits[i] > 127).collect();
    Ok(ActivationShare { share, int16, linear: limits.len() })
}

/// A network that gives raw outputs, step by step.
trait Runner {
    /// Starts an episode from a state, or from the zero state.
    fn start(&mut self, state: Option<&[f32]>);
    fn infer(&mut self, observation: &[f32]) -> Result<&[f32]>;
}

impl Runner for Head<'_, '_> {
    fn start(&mut self, state: Option<&[f32]>) {
        self.reset();
        self.state_mut().iter_mut().zip(state.unwrap_or_default()).for_each(|(to, from)| *to = *from);
    }

    fn infer(&mut self, observation: &[f32]) -> Result<&[f32]> {
        let image = *self.image();
        if image.noise_len() + image.prefix_bytes() == 0 {
            return Ok(Head::infer(self, observation)?);
        }
        let (observation, noise) = take_prefix(self, observation)?;
        if image.noise_len() == 0 {
            return Ok(Head::infer(self, observation)?);
        }
        Ok(self.infer_with_noise(observation, noise)?)
    }
}

impl Runner for Unrounded<'_> {
    fn start(&mut self, state: Option<&[f32]>) {
        self.state_mut().fill(0.0);
        self.state_mut().iter_mut().zip(state.unwrap_or_default()).for_each(|(to, from)| *to = *from);
    }

    fn infer(&mut self, observation: &[f32]) -> Result<&[f32]> {
        Unrounded::infer(self, observation)
    }
}

/// A network in f32.
struct Plain<'g> {
    evaluator: Evaluator<'g>,
    output: Vec<f32>,
}

impl Runner for Plain<'_> {
    fn start(&mut self, state: Option<&[f32]>) {
        self.evaluator.start(state);
    }

    fn infer(&mut self, observation: &[f32]) -> Result<&[f32]> {
        self.output = self.evaluator.step(observation, &mut |_, _| {});
        Ok(&self.output)
    }
}

fn compare(image: &Image<'_>, dataset: &Dataset, network: &mut impl Runner) -> Result<ErrorReport> {
    ErrorSums::over(image.output().len, dataset, 0..dataset.length.len(), network)?.report(
        bits_per_weight(image),
        image.bytes(),
        &dataset.path,
    )
}

/// Sums of errors over a part of a recording, which give the errors of the whole when they are added up.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ErrorSums {
    /// Differences to the recorded values, of each dimension of the raw output.
    error: Vec<Moment>,
    /// Recorded values of each dimension.
    signal: Vec<Moment>,
    /// Largest absolute difference.
    max_abs: f64,
    /// Compared observations.
    steps: usize,
}

impl ErrorSums {
    /// Runs `image` over a range of the recording's episodes, as [`evaluate`] does over all.
    ///
    /// # Errors
    ///
    /// If the recording has no actions, or the image cannot run on an observation.
    pub fn of(image: Image<'_>, dataset: &Dataset, episodes: Range<usize>) -> Result<Self> {
        with_head(image, |head| Self::over(image.output().len, dataset, episodes, head))
    }

    fn over(out_len: usize, dataset: &Dataset, episodes: Range<usize>, network: &mut impl Runner) -> Result<Self> {
        let none = vec![Moment::default(); out_len];
        let mut sums = Self { error: none.clone(), signal: none, max_abs: 0.0, steps: 0 };
        for episode in episodes {
            network.start(dataset.start(episode).as_deref());
            for (step, obs) in dataset.episode(episode).enumerate() {
                let at = || format!("{}: episode {episode}, step {step}", dataset.path.display());
                let out = network.infer(&obs).with_context(at)?;
                let recorded = dataset.action_at(episode, step).context("array \"action\" is missing")?;
                for (i, (&y, &r)) in out.iter().zip(&recorded).enumerate() {
                    let difference = f64::from(y) - f64::from(r);
                    sums.error[i].add(difference);
                    sums.signal[i].add(f64::from(r));
                    sums.max_abs = sums.max_abs.max(difference.abs());
                }
                sums.steps += 1;
            }
        }
        Ok(sums)
    }

    /// Adds the sums of another part of the same recording.
    ///
    /// # Errors
    ///
    /// If the sums are of another number of dimensions.
    pub fn add(&mut self, other: &Self) -> Result<()> {
        let [own, others] = [&*self, other].map(|sums| (sums.error.len(), sums.signal.len()));
        ensure!(own == others, "sums of {} and {} dimensions cannot be added", own.0, others.0);
        let pairs = self.error.iter_mut().zip(&other.error).chain(self.signal.iter_mut().zip(&other.signal));
        pairs.for_each(|(own, other)| own.join(other));
        self.max_abs = self.max_abs.max(other.max_abs);
        self.steps += other.steps;
        Ok(())
    }

    /// Takes the recorded values of a whole recording, of which the errors are those of a part: the variance of a short
    /// part says little.
    #[must_use]
    pub fn relative_to(mut self, whole: &Dataset) -> Self {
        self.signal = vec![Moment::default(); self.signal.len()];
        for (episode, steps) in whole.length.iter().enumerate() {
            for recorded in (0..*steps).filter_map(|step| whole.action_at(episode, step)) {
                self.signal.iter_mut().zip(recorded).for_each(|(signal, r)| signal.add(f64::from(r)));
            }
        }
        self
    }

    /// Returns the errors of an image of `bytes` bytes, at `bpw` bits per weight; `recording` names the recording in an
    /// error.
    ///
    /// # Errors
    ///
    /// If the recorded actions never vary.
    pub fn report(&self, bpw: f64, bytes: usize, recording: &Path) -> Result<ErrorReport> {
        let Differences { nmse, worst_nmse, worst_dimension } = self.differences(recording)?;
        Ok(ErrorReport { nmse, worst_nmse, max_abs: self.max_abs, steps: self.steps, bpw, bytes, worst_dimension })
    }

    fn differences(&self, recording: &Path) -> Result<Differences> {
        let ratios: Vec<(usize, f64)> = (0..self.error.len())
            .filter(|&i| self.signal[i].variance() > 0.0)
            .map(|i| (i, self.error[i].mean_square() / self.signal[i].variance()))
            .collect();
        ensure!(
            !ratios.is_empty(),
            "{}: the policy's actions never vary over its {}; record episodes in which the robot acts",
            recording.display(),
            count(self.steps, "observation")
        );
        let (worst_dimension, worst_nmse) =
            ratios.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or_default();
        let nmse = ratios.iter().map(|r| r.1).sum::<f64>() / ratios.len() as f64;
        Ok(Differences { nmse, worst_nmse, worst_dimension })
    }
}

/// Relative errors; see [`ErrorReport`].
struct Differences {
    nmse: f64,
    worst_nmse: f64,
    worst_dimension: usize,
}

/// Reads the held-out recording of a policy folder that must belong to `image`.
pub fn heldout(policy_dir: &Path, image: &Image<'_>) -> Result<Dataset> {
    let mut dataset = Recording::Heldout.require(Some(policy_dir), None, Sizes::of_image(image), "actq eval")?;
    if dataset.action.is_none() {
        let source = Policy::load(policy_dir).ok().filter(|policy| policy.digest == image.digest());
        fill_missing(&mut dataset, source.as_ref())?;
    }
    Ok(dataset)
}

/// Reads the held-out recording in `file`, or without it in the policy's folder. If it holds no actions, or others,
/// `source` gives them: the policy that the image was made from. Returns how they differ, too.
pub fn heldout_from(
    policy_dir: Option<&Path>,
    file: Option<&Path>,
    source: Option<&Policy>,
    image: &Image<'_>,
) -> Result<(Dataset, Option<Difference>)> {
    let mut dataset = Recording::Heldout.require(policy_dir, file, Sizes::of_image(image), "actq eval")?;
    let difference = fill_actions(&mut dataset, source)?;
    Ok((dataset, difference))
}

/// Gives a recording the actions of `source`, the policy that the image was made from, if it has none or others. Returns
/// how they differ. Without a source, recorded actions stay.
pub fn fill_actions(dataset: &mut Dataset, source: Option<&Policy>) -> Result<Option<Difference>> {
    let difference = source.and_then(|source| recorded::use_policy_of(dataset, &source.graph));
    fill_missing(dataset, source)?;
    Ok(difference)
}

/// Fills in missing actions by `source`, the policy that the image was made from.
pub(super) fn fill_missing(dataset: &mut Dataset, source: Option<&Policy>) -> Result<()> {
    if dataset.action.is_none() {
        let source = source.with_context(|| {
            format!(
                "{}: array \"action\" is missing, and the policy that the image was made from is not given: \
                 name its folder with --policy",
                dataset.path.display()
            )
        })?;
        dataset.fill_actions(&source.graph);
    }
    Ok(())
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Moment {
    n: f64,
    sum: f64,
    square: f64,
}

impl Moment {
    fn add(&mut self, x: f64) {
        self.n += 1.0;
        self.sum += x;
        self.square += x * x;
    }

    fn join(&mut self, other: &Self) {
        self.n += other.n;
        self.sum += other.sum;
        self.square += other.square;
    }

    fn mean_square(&self) -> f64 {
        self.square / self.n
    }

    fn variance(&self) -> f64 {
        // The rounding noise of a constant sequence may have either sign.
        let variance = self.mean_square() - square(self.sum / self.n);
        if variance > 1e-12 * self.mean_square() { variance } else { 0.0 }
    }
}
