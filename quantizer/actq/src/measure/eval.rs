//! Errors of an image's actions against the f32 policy's.

use std::path::Path;

use actq_kernels::{Head, Image};
use serde::Serialize;

use super::size::bits_per_weight;
use super::unrounded::Unrounded;
use crate::data::{Dataset, Recording, Sizes};
use crate::error::{Context, Result, ensure};
use crate::graph::{Evaluator, Graph};
use crate::policy::Policy;
use crate::runtime::with_head;

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
    /// Bits per weight, everything counted.
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
    Ok(differences(graph.len_of(graph.output()), dataset, &mut network)?.nmse)
}

/// Error that rounding the activations adds to an image.
#[derive(Clone, Debug)]
pub struct ActivationShare {
    /// Error (NMSE) of the image's weights with activations in f32.
    pub unrounded_nmse: f64,
    /// Share of the image's error that disappears then; below 0 if rounding the activations happens to help.
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
    Ok(ActivationShare { unrounded_nmse, share, int16, linear: limits.len() })
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
        if image.noise_len() == 0 {
            return Ok(Head::infer(self, observation)?);
        }
        let (observation, noise) =
            observation.split_at_checked(image.obs_len()).context("the observation has no noise")?;
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
    let Differences { nmse, worst_nmse, worst_dimension, max_abs } = differences(image.output().len, dataset, network)?;
    let (steps, bpw, bytes) = (dataset.frames(), bits_per_weight(image), image.bytes());
    Ok(ErrorReport { nmse, worst_nmse, max_abs, steps, bpw, bytes, worst_dimension })
}

/// Differences of a network's outputs to the recorded ones; see [`ErrorReport`].
struct Differences {
    nmse: f64,
    worst_nmse: f64,
    worst_dimension: usize,
    max_abs: f64,
}

fn differences(out_len: usize, dataset: &Dataset, network: &mut impl Runner) -> Result<Differences> {
    let mut error = vec![Moment::default(); out_len];
    let mut signal = vec![Moment::default(); out_len];
    let mut max_abs = 0f64;
    for episode in 0..dataset.length.len() {
        network.start(dataset.start(episode).as_deref());
        for (step, obs) in dataset.episode(episode).enumerate() {
            let at = || format!("{}: episode {episode}, step {step}", dataset.path.display());
            let out = network.infer(&obs).with_context(at)?;
            let recorded = dataset.action_at(episode, step).context("array \"action\" is missing")?;
            for (i, (&y, &r)) in out.iter().zip(&recorded).enumerate() {
                let difference = f64::from(y) - f64::from(r);
                error[i].add(difference);
                signal[i].add(f64::from(r));
                max_abs = max_abs.max(difference.abs());
            }
        }
    }
    let ratios: Vec<(usize, f64)> = (0..out_len)
        .filter(|&i| signal[i].variance() > 0.0)
        .map(|i| (i, error[i].mean_square() / signal[i].variance()))
        .collect();
    ensure!(
        !ratios.is_empty(),
        "{}: the recorded actions never vary; record episodes in which the robot acts",
        dataset.path.display()
    );
    let (worst_dimension, worst_nmse) = ratios.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or_default();
    let nmse = ratios.iter().map(|r| r.1).sum::<f64>() / ratios.len() as f64;
    Ok(Differences { nmse, worst_nmse, worst_dimension, max_abs })
}

/// Reads the held-out recording of a policy folder that must belong to `image`.
pub fn heldout(policy_dir: &Path, image: &Image<'_>) -> Result<Dataset> {
    let mut dataset = Recording::Heldout.require(Some(policy_dir), None, Sizes::of_image(image), "actq eval")?;
    if dataset.action.is_none() {
        let source = Policy::load(policy_dir).ok().filter(|policy| policy.digest == image.digest());
        fill_actions(&mut dataset, source.as_ref())?;
    }
    Ok(dataset)
}

/// Reads the held-out recording in `file`, or without it in the policy's folder. If it holds no actions, `source` gives
/// them: the policy that the image was made from.
pub fn heldout_from(
    policy_dir: Option<&Path>,
    file: Option<&Path>,
    source: Option<&Policy>,
    image: &Image<'_>,
) -> Result<Dataset> {
    let mut dataset = Recording::Heldout.require(policy_dir, file, Sizes::of_image(image), "actq eval")?;
    fill_actions(&mut dataset, source)?;
    Ok(dataset)
}

/// Fills in missing actions by `source`, the policy that the image was made from.
pub fn fill_actions(dataset: &mut Dataset, source: Option<&Policy>) -> Result<()> {
    if dataset.action.is_none() {
        let source = source.with_context(|| {
            format!(
                "{}: array \"action\" is missing, and no policy is given that could compute it: \
                 name its folder with --policy",
                dataset.path.display()
            )
        })?;
        dataset.fill_actions(&source.graph);
    }
    Ok(())
}

#[derive(Clone, Default)]
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

    fn mean_square(&self) -> f64 {
        self.square / self.n
    }

    fn variance(&self) -> f64 {
        // The rounding noise of a constant sequence may have either sign.
        let variance = self.mean_square() - (self.sum / self.n).powi(2);
        if variance > 1e-12 * self.mean_square() { variance } else { 0.0 }
    }
}
