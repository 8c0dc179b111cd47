//! Codes of a learned network, one width for all rows: rounded, or learned.

use actq::calibrate::widening::Widening;
use actq::calibrate::windows::Windows;
use actq::graph::{Graph, Network, Weights, zero_state};
use actq::methods::distill::activations::choose_activations;
use actq::methods::distill::objective::Frames;
use actq::methods::distill::schedule::Bounds;
use actq::methods::distill::train::{Task, distill, recorded_error};
use actq::methods::scale::{Scales, round_to};
use actq::methods::{Quantized, Recipe};
use actq::random::Random;
use actq_kernels::Width;

/// Frames, or windows, that a column's mean square is taken over.
const MAX_FRAMES: usize = 512;
/// Activation magnitude of int8.
const INT8: u16 = 127;

/// Way of making codes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coding {
    /// Rounded after learning.
    Rounded,
    /// Learned, from the f32 network's weights on, for this many steps.
    Learned(usize),
}

/// A network with codes.
#[derive(Clone, Debug)]
pub struct Coded {
    /// Structure, biases, norms.
    pub graph: Graph,
    /// Codes and scales.
    pub quantized: Vec<Quantized>,
}

impl Coded {
    /// Returns the weights that the codes stand for.
    fn weights(&self) -> Weights {
        let mut weights = Weights::of(&self.graph);
        for (weights, quantized) in weights.matrices.iter_mut().zip(&self.quantized) {
            weights.set(|values| values.copy_from_slice(&quantized.dequantized()));
        }
        weights
    }
}

/// Settings of the codes.
#[derive(Clone, Copy, Debug)]
pub struct Coder {
    /// Width of all rows.
    pub width: Width,
    /// Noise on the inputs.
    pub widening: Widening,
    /// Weighting of frames.
    pub frames: Frames,
    /// Seed of the batches.
    pub seed: u64,
}

impl Coder {
    /// Makes codes of a network that learned from the teacher in `windows`.
    pub fn code(&self, graph: &Graph, coding: Coding, windows: &Windows, progress: &mut dyn FnMut(f64)) -> Coded {
        let widths: Vec<_> = graph.matrices.iter().map(|matrix| vec![Some(self.width); matrix.rows]).collect();
        let importance = column_squares(graph, windows, self.seed);
        let Coding::Learned(steps) = coding else {
            let of_matrix = |m: usize| {
                let matrix = &graph.matrices[m];
                round_to(matrix, self.width, Scales::fit(matrix, &widths[m], 0, &importance[m]))
            };
            return Coded { graph: graph.clone(), quantized: (0..graph.matrices.len()).map(of_matrix).collect() };
        };
        let task = Task {
            graph,
            widths: &widths,
            group: 0,
            importance: &importance,
            x_max: &vec![INT8; graph.matrices.len()],
            recipe: Recipe::new(self.widening),
            frames: self.frames,
            watched: None,
            bounds: Bounds { steps: Some(steps), time: None },
            seed: self.seed,
        };
        let learned = distill(&task, windows, &mut |now| progress(now.share));
        Coded { graph: learned.graph, quantized: learned.quantized }
    }

    /// Returns the way of making codes that has the lower error on held-out episodes; `tried` has learned from the
    /// others. The learned way is taken without episodes to hold out.
    pub fn coding(
        &self,
        tried: Option<&Graph>,
        fold: Option<&(Windows, Windows)>,
        (trial, steps): (usize, usize),
    ) -> Coding {
        let (Some(graph), Some((learned_from, held_out))) = (tried, fold) else { return Coding::Learned(steps) };
        let x_max = vec![INT8; graph.matrices.len()];
        let [rounded, learned] = [Coding::Rounded, Coding::Learned(trial)].map(|coding| {
            let coded = self.code(graph, coding, learned_from, &mut |_| {});
            let network = Network::rounded(&coded.graph, &x_max);
            recorded_error(&network, &coded.weights(), held_out, None, self.seed)
        });
        if rounded <= learned { Coding::Rounded } else { Coding::Learned(steps) }
    }

    /// Returns the activation magnitudes: int16 where rounding to int8 adds much error.
    pub fn activations(&self, coded: &Coded, windows: &Windows) -> Vec<u16> {
        let least = vec![INT8; coded.quantized.len()];
        choose_activations(&coded.graph, &coded.quantized, windows, &least, None, self.seed)
    }
}

/// Returns the mean square of each column of each matrix's operand at recorded observations.
pub fn column_squares(graph: &Graph, windows: &Windows, seed: u64) -> Vec<Vec<f64>> {
    let samples = (MAX_FRAMES / windows.window).max(1);
    let batch = windows.batch(samples, None, &mut Random::new(seed));
    let network = Network::new(graph);
    let pass = network.forward(&Weights::of(graph), batch.frames, &mut zero_state(graph, samples));
    let mut squares: Vec<Vec<f64>> = graph.matrices.iter().map(|matrix| vec![0.0; matrix.cols]).collect();
    let mut counts = vec![0usize; squares.len()];
    for (m, operand) in network.operands(&pass) {
        counts[m] += operand.nrows();
        for row in operand.rows() {
            squares[m].iter_mut().zip(row).for_each(|(sum, x)| *sum += f64::from(*x).powi(2));
        }
    }
    for (squares, count) in squares.iter_mut().zip(counts) {
        squares.iter_mut().for_each(|sum| *sum /= count.max(1) as f64);
    }
    squares
}
