//! Distillation on the recorded observations: the quantized network learns to give what the f32 network gives. No labels, no
//! environment.
//!
//! Codes are rounded from latent weights in units of the step; the derivative passes the rounding as if it were not there
//! (straight-through). Row scales, biases and norms learn too. The inputs are widened by noise and by differences of
//! observations, and the f32 network is asked again at the widened input. Adam (arXiv 1412.6980), learning rates falling to zero
//! along a cosine.

use actq_kernels::Width;
use half::bf16;
use ndarray::Array2;
use rayon::prelude::*;

use crate::calibrate::windows::{Batch, Windows};
use crate::graph::{Graph, Network, Pass, WeightMatrix, Weights, zero_state};
use crate::methods::quantized::Quantized;
use crate::methods::scale::Scales;
use crate::random::Random;

/// Learning rates: latent weights in steps, logarithms of the scales, biases and norms.
const RATE_LATENT: f32 = 4e-3;
const RATE_SCALE: f32 = 3e-3;
const RATE_VECTOR: f32 = 1e-3;
/// Samples of a batch: frames, or windows of a recurrent network.
const FRAMES: usize = 256;
const WINDOWS: usize = 32;
/// Parts that a batch is cut into, whatever the number of threads, so that sums have one order.
const SHARDS: usize = 4;
/// The gradient's norm is limited to this for recurrent networks.
const CLIP: f32 = 1.0;

/// Scales that are smaller count as this, so that their logarithm is finite.
const SMALLEST: f32 = 1e-12;

/// A matrix while it learns.
struct Latent {
    widths: Vec<Option<Width>>,
    /// Codes before rounding, `[row, col]`.
    codes: Array2<f32>,
    /// Natural logarithm of each row's scale.
    log_scales: Vec<f32>,
    /// The scales that learning started from, of which those of groups stay.
    fitted: Scales,
}

/// What rounds a latent code: the lowest and highest code, and the level of code `c`, `step * c + base`.
fn grid(width: Width) -> (f32, f32, f32, f32) {
    match width {
        Width::W8 => (-127.0, 127.0, 1.0, 0.0),
        _ => {
            let top = width.max_level() as f32;
            (0.0, top, 2.0, -top)
        }
    }
}

impl Latent {
    fn new(matrix: &WeightMatrix, widths: &[Option<Width>], group: usize, importance: &[f64]) -> Self {
        let fitted = Scales::fit(matrix, widths, group, importance);
        let log_scales: Vec<f32> = fitted.rows.iter().map(|s| s.to_f32().max(SMALLEST).ln()).collect();
        let mut latent =
            Self { widths: widths.to_vec(), codes: Array2::zeros((matrix.rows, matrix.cols)), log_scales, fitted };
        for (r, row) in matrix.data.chunks_exact(matrix.cols).enumerate() {
            let Some(width) = widths[r] else { continue };
            let (_, _, step, base) = grid(width);
            for (c, w) in row.iter().enumerate() {
                latent.codes[[r, c]] = (w / latent.at(r, c) - base) / step;
            }
        }
        latent
    }

    fn scale(&self, row: usize) -> f32 {
        bf16::from_f32(self.log_scales[row].exp()).to_f32()
    }

    /// What a level is multiplied with.
    fn at(&self, row: usize, col: usize) -> f32 {
        self.scale(row) * f32::from(self.fitted.group_scale(row, col))
    }

    /// The weights that the rounded codes stand for.
    fn weights(&self, out: &mut Array2<f32>) {
        for (r, width) in self.widths.iter().enumerate() {
            let mut out = out.row_mut(r);
            let Some(width) = *width else {
                out.fill(0.0);
                continue;
            };
            let (low, high, step, base) = grid(width);
            let scale = self.scale(r);
            for (i, (w, c)) in out.iter_mut().zip(self.codes.row(r)).enumerate() {
                let scale = scale * f32::from(self.fitted.group_scale(r, i));
                *w = (c.round_ties_even().clamp(low, high) * step + base) * scale;
            }
        }
    }

    /// Turns the derivative by the weights into those by the latent codes (in place) and by the scales' logarithms.
    fn chain(&self, grad: &mut Array2<f32>) -> Vec<f32> {
        let mut by_scale = vec![0.0; self.widths.len()];
        for (r, width) in self.widths.iter().enumerate() {
            let mut grad = grad.row_mut(r);
            let Some(width) = *width else {
                grad.fill(0.0);
                continue;
            };
            let (low, high, step, base) = grid(width);
            let scale = self.scale(r);
            for (i, (g, c)) in grad.iter_mut().zip(self.codes.row(r)).enumerate() {
                let scale = scale * f32::from(self.fitted.group_scale(r, i));
                by_scale[r] += *g * (c.round_ties_even().clamp(low, high) * step + base) * scale;
                // Beyond the grid only a pull back inside passes.
                let outside = (*c < low - 0.5 && *g > 0.0) || (*c > high + 0.5 && *g < 0.0);
                *g = if outside { 0.0 } else { *g * step * scale };
            }
        }
        by_scale
    }

    fn quantized(&self) -> Quantized {
        let (rows, cols) = self.codes.dim();
        let code = |r: usize, c: &f32| match self.widths[r] {
            None => 0,
            Some(width) => {
                let (low, high, ..) = grid(width);
                c.round_ties_even().clamp(low, high) as i32 as u8
            }
        };
        Quantized {
            rows,
            cols,
            group: self.fitted.group,
            widths: self.widths.clone(),
            scales: (0..rows).map(|r| bf16::from_f32(self.scale(r))).collect(),
            group_scales: self.fitted.groups.clone(),
            codes: self.codes.indexed_iter().map(|((r, _), c)| code(r, c)).collect(),
        }
    }
}

/// Adam's moments of a run of parameters.
#[derive(Default)]
struct Adam {
    first: Vec<f32>,
    second: Vec<f32>,
}

impl Adam {
    /// Moves `parameters` along `grads` at `rate`; `t` counts from 1.
    fn step<'p>(
        &mut self,
        parameters: impl Iterator<Item = &'p mut f32>,
        grads: impl Iterator<Item = f32>,
        rate: f32,
        t: i32,
    ) {
        const FIRST: f32 = 0.9;
        const SECOND: f32 = 0.999;
        let (c1, c2) = (1.0 / (1.0 - FIRST.powi(t)), 1.0 / (1.0 - SECOND.powi(t)));
        for (i, (p, g)) in parameters.zip(grads).enumerate() {
            if i == self.first.len() {
                self.first.push(0.0);
                self.second.push(0.0);
            }
            let (m, v) = (&mut self.first[i], &mut self.second[i]);
            *m = FIRST * *m + (1.0 - FIRST) * g;
            *v = SECOND * *v + (1.0 - SECOND) * g * g;
            *p -= rate * *m * c1 / ((*v * c2).sqrt() + 1e-12);
        }
    }
}

/// What a distillation is to do.
#[derive(Clone, Debug)]
pub struct Task<'a> {
    /// The structure to learn, after compaction; its weights are where learning starts.
    pub graph: &'a Graph,
    /// Width of every row of every matrix.
    pub widths: &'a [Vec<Option<Width>>],
    /// Columns per u8 scale; 0 = none.
    pub group: usize,
    /// Importance of every column of every matrix, for the first scales.
    pub importance: &'a [Vec<f64>],
    /// Activation magnitude of every matrix.
    pub x_max: &'a [u16],
    /// Steps to take.
    pub steps: usize,
    /// Seed of the batches.
    pub seed: u64,
}

/// Learns codes, scales, biases and norms. Returns the quantized matrices, and puts biases and norms into `graph`. `progress` is
/// called after each step with its number.
pub fn distill(task: &Task<'_>, windows: &Windows<'_>, mut progress: impl FnMut(usize)) -> (Vec<Quantized>, Graph) {
    let network = Network::rounded(task.graph, task.x_max);
    let mut weights = Weights::of(task.graph);
    let matrices = task.graph.matrices.iter().zip(task.widths).zip(task.importance);
    let mut latents: Vec<Latent> =
        matrices.map(|((matrix, widths), importance)| Latent::new(matrix, widths, task.group, importance)).collect();
    let mut adam_codes: Vec<Adam> = latents.iter().map(|_| Adam::default()).collect();
    let mut adam_scales: Vec<Adam> = latents.iter().map(|_| Adam::default()).collect();
    let mut adam_vectors = Adam::default();
    let mut random = Random::new(task.seed);
    let size = if windows.recurrent() { WINDOWS } else { FRAMES };
    for step in 0..task.steps {
        for (latent, weights) in latents.iter().zip(&mut weights.matrices) {
            latent.weights(weights);
        }
        let seeds: Vec<u64> = (0..SHARDS).map(|_| random.bits()).collect();
        let shards: Vec<Weights> = seeds
            .into_par_iter()
            .map(|seed| {
                let batch = windows.batch(size / SHARDS, true, &mut Random::new(seed));
                gradient(&network, &weights, windows, batch)
            })
            .collect();
        let mut grads = weights.zeros_like();
        for shard in &shards {
            grads.add(shard);
        }
        if windows.recurrent() {
            clip(&mut grads);
        }
        let t = step as i32 + 1;
        let fall = 0.5 * (1.0 + (std::f32::consts::PI * step as f32 / task.steps as f32).cos());
        for (m, latent) in latents.iter_mut().enumerate() {
            let by_scale = latent.chain(&mut grads.matrices[m]);
            let by_code = grads.matrices[m].iter().copied();
            adam_codes[m].step(latent.codes.iter_mut(), by_code, RATE_LATENT * fall, t);
            adam_scales[m].step(latent.log_scales.iter_mut(), by_scale.into_iter(), RATE_SCALE * fall, t);
        }
        let by_vector = grads.vectors.iter().flatten().flatten().copied();
        adam_vectors.step(weights.vectors.iter_mut().flatten().flatten(), by_vector, RATE_VECTOR * fall, t);
        progress(step + 1);
    }
    let mut graph = task.graph.clone();
    weights.store_vectors(&mut graph);
    (latents.iter().map(Latent::quantized).collect(), graph)
}

/// The loss's derivative by the (rounded) weights on a batch.
fn gradient(network: &Network<'_>, weights: &Weights, windows: &Windows<'_>, batch: Batch) -> Weights {
    let (passes, errors, _) = run(network, weights, windows, batch);
    let mut grads = weights.zeros_like();
    let samples = errors.first().map_or(0, Array2::nrows);
    let mut d_state = zero_state(network.graph, samples);
    for (pass, error) in passes.iter().zip(errors).rev() {
        network.backward(weights, pass, error, &mut d_state, &mut grads, &mut |_, _, _, _| {});
    }
    grads
}

/// The mean over samples and outputs of squared error over variance, against the f32 network.
pub fn loss(network: &Network<'_>, weights: &Weights, windows: &Windows<'_>, batch: Batch) -> f32 {
    run(network, weights, windows, batch).2
}

/// Forward passes of a batch, the loss's derivative by the output of each, and the loss.
fn run(
    network: &Network<'_>,
    weights: &Weights,
    windows: &Windows<'_>,
    batch: Batch,
) -> (Vec<Pass>, Vec<Array2<f32>>, f32) {
    let targets = windows.teach(&batch);
    let mut state = batch.state;
    let passes: Vec<Pass> = batch.steps.into_iter().map(|obs| network.forward(weights, obs, &mut state)).collect();
    let varying = windows.output_variance.iter().filter(|v| **v > 0.0).count().max(1);
    let count = targets.iter().map(Array2::nrows).sum::<usize>() * varying;
    let mut loss = 0.0;
    let errors = passes.iter().zip(&targets).map(|(pass, target)| {
        let mut d = pass.output() - target;
        for mut row in d.rows_mut() {
            for (d, variance) in row.iter_mut().zip(&windows.output_variance) {
                let weight = if *variance > 0.0 { 1.0 / (variance * count as f32) } else { 0.0 };
                loss += *d * *d * weight;
                *d *= 2.0 * weight;
            }
        }
        d
    });
    let errors = errors.collect();
    (passes, errors, loss)
}

fn clip(grads: &mut Weights) {
    let square: f32 = grads.matrices.iter().map(|m| m.iter().map(|g| g * g).sum::<f32>()).sum::<f32>()
        + grads.vectors.iter().flatten().flatten().map(|g| g * g).sum::<f32>();
    let factor = CLIP / square.sqrt().max(CLIP);
    grads.matrices.iter_mut().for_each(|m| m.mapv_inplace(|g| g * factor));
    grads.vectors.iter_mut().flatten().flatten().for_each(|g| *g *= factor);
}
