//! Distillation on the recorded observations: the quantized network learns to give the f32 network's outputs, without
//! labels or environment.
//!
//! Codes are rounded from latent weights in units of the step; the derivative ignores the rounding (straight-through).
//! Row scales, biases and norms learn, too. The inputs are widened ([`Widening`]), and the f32 network is evaluated at
//! the widened inputs.

use actq_kernels::Width;
use ndarray::{Array2, Axis};
use rayon::prelude::*;

use super::adam::{Adam, Stride};
use super::latent::{Latent, LearningRates, RateScaling};
use super::lessons::{Lessons, Source, TrainingBatch};
use super::objective::{Frames, Objective};
use super::schedule::{Bounds, Schedule, most_steps};
use crate::calibrate::widening::Widening;
use crate::calibrate::windows::{Batch, Windows};
use crate::data::mean_and_variance;
use crate::graph::tied::Tied;
use crate::graph::{Derivatives, Graph, Matrix, Network, Node, NodeKind, STRIP, Vectors, WeightMatrix, Weights};
use crate::methods::learning::Recipe;
use crate::methods::options::Effort;
use crate::methods::quantized::Quantized;
use crate::numbers::square;
use crate::random::Random;

/// Learning rates.
struct Rates {
    /// Rate of latent weights, in steps, of rows of 2 bits.
    latent: f32,
    /// Rate of the scales' logarithms.
    scale: f32,
    /// Rate of biases and norms.
    vector: f32,
    /// Strides of wider rows.
    scaling: RateScaling,
}

/// Rates of feed-forward networks. With higher ones, they fit the recording better and held-out episodes worse.
const OF_FRAMES: Rates = Rates { latent: 4e-3, scale: 3e-3, vector: 1e-3, scaling: RateScaling::Equal };
/// Rates of networks that lost more than half of the weights.
const OF_SMALL: Rates = Rates { latent: 8e-3, scale: 6e-3, vector: 2e-3, scaling: RateScaling::ByWidth };
/// Rates of recurrent networks, which take fewer steps: with the rates above, g1_lstm64 ends at 1.6 times the error
/// (docs/records).
const OF_WINDOWS: Rates = Rates { latent: 3e-2, scale: 1e-2, vector: 1e-2, scaling: RateScaling::ByWidth };
/// Samples of a batch: frames, or windows of a recurrent network.
const FRAMES: usize = 256;
const WINDOWS: usize = 16;
/// Parts of a batch, independent of the number of threads, so that sums have one order. The fewer windows in a part,
/// the slower the products with a recurrent matrix, which have a row for each.
const FRAME_SHARDS: usize = 4;
const WINDOW_SHARDS: usize = 2;
/// Least steps between two runs for a recurrent network's own states, and frames of the recording for each step.
const MIN_STEPS_BETWEEN_STATE_RUNS: usize = 100;
const RECORDED_FRAMES_PER_STEP: usize = 50;
/// Frames that the units of biases are measured on.
const UNIT_FRAMES: usize = 1024;
/// Batches that an error is measured on, and frames in each.
const ERROR_BATCHES: usize = 16;
const ERROR_FRAMES: usize = 512;
/// Largest norm of a recurrent network's gradient.
const MAX_GRADIENT_NORM: f32 = 1.0;

/// Parameters of a distillation.
#[derive(Clone, Debug)]
pub struct Task<'a> {
    /// Structure to learn, after compaction; its weights are the start of learning.
    pub graph: &'a Graph,
    /// Width of every row of every matrix.
    pub widths: &'a [Vec<Option<Width>>],
    /// Columns per u8 scale; 0 = no group scales.
    pub group: usize,
    /// Importance of every column of every matrix, for the first scales.
    pub importance: &'a [Vec<f64>],
    /// Activation magnitude of every matrix.
    pub x_max: &'a [u16],
    /// Noise on the inputs, and factor on the rates.
    pub recipe: Recipe,
    /// Weighting of frames.
    pub frames: Frames,
    /// Held-out observations, to report the error on.
    pub watched: Option<&'a Windows>,
    /// Limits of learning.
    pub bounds: Bounds,
    /// Seed of the batches.
    pub seed: u64,
}

impl Task<'_> {
    /// Returns `true` if the network has lost more than half of the weights. Then it must learn anew, not only adapt.
    pub fn has_lost_half(&self, windows: &Windows) -> bool {
        2 * self.weights() < windows.graph.weights()
    }

    /// Returns `true` if the network keeps less than a quarter of the weights.
    pub fn keeps_less_than_a_quarter(&self, windows: &Windows) -> bool {
        4 * self.weights() < windows.graph.weights()
    }

    /// Returns what learning starts from: every weight rounded to the nearest level.
    pub(super) fn start(&self) -> TrainResult {
        let quantized = self.latents().iter().map(Latent::quantized).collect();
        TrainResult { quantized, graph: self.graph.clone(), steps: 0 }
    }

    fn latents(&self) -> Vec<Latent> {
        let matrices = self.graph.matrices.iter().zip(self.widths).zip(self.importance);
        matrices.map(|((matrix, widths), importance)| Latent::new(matrix, widths, self.group, importance)).collect()
    }

    /// Returns the weights that have bits.
    fn weights(&self) -> usize {
        let of_matrix =
            |(matrix, widths): (&WeightMatrix, &Vec<Option<Width>>)| widths.iter().flatten().count() * matrix.cols;
        self.graph.matrices.iter().zip(self.widths).map(of_matrix).sum()
    }
}

/// Result of a distillation.
#[derive(Debug)]
pub struct TrainResult {
    /// The quantized matrices.
    pub quantized: Vec<Quantized>,
    /// Structure, with the learned biases and norms.
    pub graph: Graph,
    /// Steps taken.
    pub steps: usize,
}

/// State of learning after a step.
#[derive(Clone, Copy, Debug)]
pub struct Baseline {
    /// Share done.
    pub share: f64,
    /// Error on the widened inputs.
    pub error: f64,
    /// Latest error on the watched observations.
    pub held_out: Option<f64>,
}

/// Learns codes, scales, biases and norms. `progress` is called after each step.
pub fn distill(task: &Task<'_>, windows: &Windows, progress: &mut dyn FnMut(Baseline)) -> TrainResult {
    let network = Network::rounded(task.graph, task.x_max);
    let mut weights = Weights::of(task.graph);
    let mut latents = task.latents();
    let mut adam_vectors: Vec<Adam> = weights.vectors.iter().flatten().map(|v| Adam::new(v.len())).collect();
    let tied = Tied::of(task.graph);
    let mut units = units_of_vectors(task.graph, windows, task.seed);
    tied.take_first(&mut units);
    latents.iter_mut().zip(&mut weights.matrices).for_each(|(latent, matrix)| latent.write(matrix));
    let mut lessons = Lessons::new(task.seed);
    let (size, shards) = batch_size(task.graph, windows);
    let rates = match windows.recurrent() {
        true => OF_WINDOWS,
        false if task.has_lost_half(windows) => OF_SMALL,
        false => OF_FRAMES,
    };
    let objective = Objective::new(&windows.output_variance, task.frames);
    let mut schedule = Schedule::new(task.bounds, most_steps(task.graph, Effort::Default));
    let mut states = Vec::new();
    let mut held_out = None;
    while let Some(rate) = schedule.rate() {
        if renews_states(windows, schedule.steps()) {
            states = windows.states_of(&network, &weights);
        }
        let learned: Vec<(f32, Derivatives, Option<TrainingBatch>)> = lessons
            .next(shards)
            .into_par_iter()
            .map(|source| match source {
                Source::New(seed) => {
                    let batch = windows.batch(size / shards, Some(task.recipe.widening), &mut Random::new(seed));
                    let lesson = TrainingBatch::of(windows, batch, task.graph, &states);
                    let (loss, derivatives) = gradient(&network, &weights, &objective, &lesson);
                    (loss, derivatives, Some(lesson))
                }
                Source::Kept(index) => {
                    let (loss, derivatives) = gradient(&network, &weights, &objective, lessons.kept(index));
                    (loss, derivatives, None)
                }
            })
            .collect();
        let loss = learned.iter().map(|(loss, ..)| loss / shards as f32).sum();
        let mut of_shards = Vec::with_capacity(shards);
        for (_, derivatives, lesson) in learned {
            of_shards.push(derivatives);
            lesson.into_iter().for_each(|lesson| lessons.keep(lesson));
        }
        let (mut of_matrices, mut of_vectors) = Derivatives::sum(task.graph, of_shards);
        tied.sum(&mut of_vectors);
        if windows.recurrent() {
            clip(&mut of_matrices, &mut of_vectors);
        }
        schedule.took(loss);
        let stride = |of: f32| Stride::new(of * task.recipe.rate * rate, schedule.steps() as u32);
        let of_codes =
            LearningRates { codes: stride(rates.latent), scales: stride(rates.scale), scaling: rates.scaling };
        let by_vector = stride(rates.vector);
        learn(&mut latents, &mut of_matrices, of_codes, &mut weights.matrices);
        let vectors = weights.vectors.iter_mut().flatten().zip(of_vectors.iter().flatten());
        for ((adam, units), (vector, grads)) in adam_vectors.iter_mut().zip(&units).zip(vectors) {
            adam.step_in_units(vector, grads, units.as_deref(), by_vector);
        }
        if let Some(watched) = task.watched.filter(|_| schedule.is_at_part()) {
            held_out = Some(recorded_error(&network, &weights, watched, None, task.seed));
        }
        progress(Baseline { share: schedule.share(), error: schedule.error().unwrap_or_default(), held_out });
    }
    let mut graph = task.graph.clone();
    weights.store_vectors(&mut graph);
    TrainResult { quantized: latents.iter().map(Latent::quantized).collect(), graph, steps: schedule.steps() }
}

/// Moves all codes and scales along `grads`, the derivatives by the weights, and writes the new weights.
fn learn(latents: &mut [Latent], grads: &mut [Array2<f32>], rates: LearningRates, weights: &mut [Matrix]) {
    let mut strips = Vec::new();
    for ((latent, grads), matrix) in latents.iter_mut().zip(grads).zip(weights) {
        strips.extend(latent.strips().zip(grads.axis_chunks_iter_mut(Axis(0), STRIP)).zip(matrix.strips()));
    }
    strips.into_par_iter().for_each(|((mut strip, mut grads), mut weights)| {
        strip.learn(grads.as_slice_mut().unwrap_or_default(), rates);
        weights.set(|values| strip.weights(values));
    });
}

/// Returns the units that each vector learns in: about the deviation of what it is added to, so that a step means the
/// same in every unit of a layer. Vectors of recurrent cells learn in the units of their gates.
fn units_of_vectors(graph: &Graph, windows: &Windows, seed: u64) -> Vec<Option<Vec<f32>>> {
    let batch = windows.batch(UNIT_FRAMES.div_ceil(windows.window), None, &mut Random::new(seed));
    let lesson =
        TrainingBatch::of(windows, batch, graph, &windows.states_of(&Network::new(graph), &Weights::of(graph)));
    let pass = lesson.pass(&Network::new(graph), &Weights::of(graph));
    let mut deviations = vec![Vec::new(); graph.nodes.len() + 1];
    pass.all_values().for_each(|(value, of)| deviations[value] = column_deviations(of));
    let of_node = |(index, node): (usize, &Node)| match &node.kind {
        // People choose the unit of the actions.
        NodeKind::Linear(_) if index + 1 == graph.output() && graph.denoising.is_none() => {
            vec![Some(windows.output_variance.iter().map(|variance| variance.sqrt()).collect())]
        }
        NodeKind::Linear(_) => vec![Some(with_least(deviations[index + 1].clone()))],
        NodeKind::LayerNorm(_) | NodeKind::RmsNorm(_) => {
            let weights = node.kind.vectors()[0].iter().map(|w| w.abs()).collect();
            vec![Some(with_least(weights)); node.kind.vectors().len()]
        }
        _ => vec![None; node.kind.vectors().len()],
    };
    graph.nodes.iter().enumerate().flat_map(of_node).collect()
}

/// Returns the standard deviation of every column.
fn column_deviations(values: &Array2<f32>) -> Vec<f32> {
    mean_and_variance(values.ncols(), || values.rows().into_iter()).1.into_iter().map(|of| of.sqrt() as f32).collect()
}

/// Raises units to a tenth of their root mean square: an element may hardly move in the recording. Units are 1 if none
/// moves.
fn with_least(mut units: Vec<f32>) -> Vec<f32> {
    let square = units.iter().map(|unit| square(f64::from(*unit))).sum::<f64>() / units.len().max(1) as f64;
    let least = if square > 0.0 { 0.1 * square.sqrt() as f32 } else { 1.0 };
    units.iter_mut().for_each(|unit| *unit = unit.max(least));
    units
}

/// Returns the samples of a batch, frames or windows, and the parts that it is cut into. A frame of an iterative head
/// is one frame per denoising step.
pub fn batch_size(graph: &Graph, windows: &Windows) -> (usize, usize) {
    match windows.recurrent() {
        true => (WINDOWS, WINDOW_SHARDS),
        false => ((FRAMES / graph.denoising_steps().isqrt()).max(4 * FRAME_SHARDS), FRAME_SHARDS),
    }
}

/// Returns `true` if a recurrent network runs over the recording again before this step, to renew its states.
pub fn renews_states(windows: &Windows, step: usize) -> bool {
    windows.recurrent()
        && step.is_multiple_of(MIN_STEPS_BETWEEN_STATE_RUNS.max(windows.frames() / RECORDED_FRAMES_PER_STEP))
}

/// Computes the loss on a lesson, and its derivatives by the (rounded) weights.
pub fn gradient(
    network: &Network<'_>,
    weights: &Weights,
    objective: &Objective<'_>,
    lesson: &TrainingBatch,
) -> (f32, Derivatives) {
    let pass = lesson.pass(network, weights);
    let (error, loss) = objective.measure(pass.output(), &lesson.target);
    (loss, network.backward(weights, pass, error, &mut lesson.zero_state()))
}

/// Returns the mean of each batch over samples and outputs of squared error over variance, against the f32 network's
/// outputs beside it.
pub fn losses<'b>(
    network: &'b Network<'_>,
    weights: &'b Weights,
    windows: &'b Windows,
    taught: impl IntoIterator<Item = (Batch, Array2<f32>)> + 'b,
) -> impl Iterator<Item = f32> + 'b {
    let objective = Objective::new(&windows.output_variance, Frames::Even);
    let states = windows.states_of(network, weights);
    taught.into_iter().map(move |(batch, target)| {
        let mut state = batch.state_of(network.graph, &states);
        objective.measure(network.forward(weights, batch.frames, &mut state).output(), &target).1
    })
}

/// Returns the mean error on batches of recorded or widened observations, the same ones for every network.
pub fn recorded_error(
    network: &Network<'_>,
    weights: &Weights,
    windows: &Windows,
    widening: Option<Widening>,
    seed: u64,
) -> f64 {
    let size = (ERROR_FRAMES / windows.window).max(1);
    let mut random = Random::new(seed);
    let taught = (0..ERROR_BATCHES).map(|_| windows.taught_batch(size, widening, &mut random));
    losses(network, weights, windows, taught).map(f64::from).sum::<f64>() / ERROR_BATCHES as f64
}

/// Scales the derivatives so that their norm is at most 1.
pub fn clip(matrices: &mut [Array2<f32>], vectors: &mut Vectors) {
    let square: f32 = matrices.iter().map(|m| m.iter().map(|g| g * g).sum::<f32>()).sum::<f32>()
        + vectors.iter().flatten().flatten().map(|g| g * g).sum::<f32>();
    let factor = MAX_GRADIENT_NORM / square.sqrt().max(MAX_GRADIENT_NORM);
    matrices.iter_mut().for_each(|m| m.mapv_inplace(|g| g * factor));
    vectors.iter_mut().flatten().flatten().for_each(|g| *g *= factor);
}
