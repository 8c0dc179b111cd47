//! Learning in f32: plain Adam with a rate that falls along a cosine.

use actq::calibrate::widening::Widening;
use actq::calibrate::windows::Windows;
use actq::graph::{Derivatives, Graph, Network, State, Weights};
use actq::methods::distill::adam::{Adam, Stride};
use actq::methods::distill::lessons::{Lessons, Source, TrainingBatch};
use actq::methods::distill::objective::{Frames, Objective};
use actq::methods::distill::train::{batch_size, clip, gradient, renews_states};
use actq::random::Random;

/// Parameters of learning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// Steps.
    pub steps: usize,
    /// Adam's rate at first.
    pub rate: f32,
    /// Noise on the inputs.
    pub widening: Widening,
    /// Weighting of frames.
    pub frames: Frames,
    /// Seed of the batches.
    pub seed: u64,
}

/// Learns all weights of a network from the answers of the one in `windows`. `units` are those of
/// [`restart`](super::start::restart): Adam's steps are taken in them. `progress` receives the share done.
pub fn fit(
    graph: &Graph,
    units: &[Option<Vec<f32>>],
    windows: &Windows,
    by: Fit,
    progress: &mut dyn FnMut(f64),
) -> Graph {
    let network = Network::new(graph);
    let mut weights = Weights::of(graph);
    let objective = Objective::new(&windows.output_variance, by.frames);
    let (samples, parts) = batch_size(graph, windows);
    let mut lessons = Lessons::new(by.seed);
    let mut states: Vec<State> = Vec::new();
    let mut of_matrices: Vec<Adam> = graph.matrices.iter().map(|m| Adam::new(m.data.len())).collect();
    let mut of_vectors: Vec<Adam> = weights.vectors.iter().flatten().map(|v| Adam::new(v.len())).collect();
    for step in 0..by.steps {
        if renews_states(windows, step) {
            states = windows.states_of(&network, &weights);
        }
        let mut learned = Vec::with_capacity(parts);
        let mut drawn = Vec::new();
        for source in lessons.next(parts) {
            match source {
                Source::New(seed) => {
                    let batch = windows.batch(samples / parts, Some(by.widening), &mut Random::new(seed));
                    let lesson = TrainingBatch::of(windows, batch, graph, &states);
                    learned.push(gradient(&network, &weights, &objective, &lesson).1);
                    drawn.push(lesson);
                }
                Source::Kept(index) => {
                    learned.push(gradient(&network, &weights, &objective, lessons.kept(index)).1);
                }
            }
        }
        drawn.into_iter().for_each(|lesson| lessons.keep(lesson));
        let (mut matrices, mut vectors) = Derivatives::sum(graph, learned);
        let share = step as f32 / by.steps as f32;
        if windows.recurrent() {
            clip(&mut matrices, &mut vectors);
        }
        let rate = by.rate * 0.5 * (1.0 + (std::f32::consts::PI * share).cos());
        let stride = Stride::new(rate, step as u32 + 1);
        let all = of_matrices.iter_mut().zip(&mut weights.matrices).zip(matrices.iter_mut().zip(units));
        for ((adam, matrix), (grads, units)) in all {
            let grads = grads.as_slice_mut().unwrap_or_default();
            matrix.set(|values| step_in_units(adam, values, grads, units.as_deref(), stride));
        }
        let pairs = weights.vectors.iter_mut().flatten().zip(vectors.iter().flatten());
        of_vectors.iter_mut().zip(pairs).for_each(|(adam, (vector, grads))| adam.step(vector, grads, stride));
        progress(share.into());
    }
    let mut learned = graph.clone();
    for (matrix, weights) in learned.matrices.iter_mut().zip(&weights.matrices) {
        matrix.data = weights.values().iter().copied().collect();
    }
    weights.store_vectors(&mut learned);
    learned
}

/// Takes a step of Adam with weights in units of their columns.
fn step_in_units(adam: &mut Adam, values: &mut [f32], grads: &mut [f32], units: Option<&[f32]>, stride: Stride) {
    let Some(units) = units else {
        adam.step(values, grads, stride);
        return;
    };
    let units = || units.iter().cycle();
    values.iter_mut().zip(grads.iter_mut()).zip(units()).for_each(|((w, g), unit)| {
        *w *= unit;
        *g /= unit;
    });
    adam.step(values, grads, stride);
    values.iter_mut().zip(units()).for_each(|(w, unit)| *w /= unit);
}
