//! The method distill. It measures how much every row matters, gives each a width within the budget, and removes rows
//! of width 0. Then it distills, or, with 0 steps, uses two-sided error feedback.

mod activations;
mod adam;
pub mod allocate;
pub mod balance;
pub mod choose;
pub mod compact;
pub mod dimension;
pub mod feedback;
mod latent;
mod lessons;
mod objective;
pub mod removal;
pub mod schedule;
pub mod size;
pub mod train;

use std::sync::OnceLock;
use std::time::Duration;

use actq_kernels::Width;
use nalgebra::DMatrix;
use rayon::prelude::*;

use super::learning::{Choice, Learning};
use super::options::Options;
use super::packing::Activations;
use super::progress::Progress;
use super::quantized::{Outcome, Quantized, QuantizedNetwork, RowAllocation};
use crate::budget::Rate;
use crate::calibrate::allowance::Allowance;
use crate::calibrate::moments::Moments;
use crate::calibrate::sensitivity::{Side, importance, output_moments};
use crate::calibrate::widening::Widening;
use crate::calibrate::windows::Windows;
use crate::data::Dataset;
use crate::error::{Result, ensure};
use crate::graph::{Graph, WeightMatrix};
use activations::{allocated, choose_activations};
use allocate::{Rows, energies};
use balance::{MixedUnits, balance, mixed_units};
use choose::{Chosen, choose, choosing};
use compact::{Compacted, add_to_bias, compact};
use dimension::{Dimension, dimensions};
use feedback::feedback;
use objective::Frames;
use removal::Effect;
use schedule::{Bounds, most_steps};
use size::Size;
use train::{Learned, Task, distill};

/// Least frames to learn from.
const LEAST_FRAMES: usize = 200;
/// Seed of the statistics, the same for every budget.
const SEED: u64 = 1;

/// Statistics of the recorded observations, for any number of budgets.
#[derive(Debug)]
pub struct RowStatistics {
    /// The network with balanced columns, and the recorded observations.
    windows: Windows,
    /// Importance of every matrix's columns; of its rows.
    inputs: Vec<Vec<f64>>,
    outputs: Vec<Vec<f64>>,
    /// Errors of removing the rows of a matrix, one by one and, when needed, together; `None` if its rows cannot be
    /// removed.
    alone: Vec<Option<Vec<f64>>>,
    together: OnceLock<Vec<Option<Vec<f64>>>>,
    /// Moments of every matrix's input, and `G`.
    moments: Vec<(Moments, DMatrix<f64>)>,
    /// Frames or windows that `G` was taken over.
    pub(super) outputs_of: usize,
    /// Matrices whose columns still have very different units.
    pub(super) mixed: Vec<MixedUnits>,
}

impl RowStatistics {
    /// Runs the f32 network over `dataset`, forwards and backwards. `moments` holds the moments of the matrices' inputs
    /// and the number of frames that they were taken over, as many as the allowance permits.
    pub fn collect(
        graph: &Graph,
        dataset: &Dataset,
        (mut moments, frames): (Vec<Moments>, usize),
        allowance: Option<Allowance>,
    ) -> Result<Self> {
        dataset.require_frames(LEAST_FRAMES, "learning from fewer overfits")?;
        let every = if allowance.is_some() { dataset.frames().div_ceil(frames.max(1)) } else { 1 };
        let windows = Windows::new(graph.clone(), dataset, every);
        ensure!(
            windows.output_variance.iter().any(|v| *v > 0.0),
            "{}: the policy gives the same action at every observation; record observations with different actions",
            dataset.path.display()
        );
        let (output_moments, outputs_of) = output_moments(&windows, allowance, SEED);
        let outputs: Vec<Vec<f64>> = output_moments.iter().map(|g| importance(g, Side::Output)).collect();
        let balanced = balance(graph, &mut moments, &outputs)?;
        let of_inputs: Vec<&Moments> = moments.iter().collect();
        let alone =
            effects(&balanced, &of_inputs, &outputs).map(|effect| effect.map(|effect| effect.alone())).collect();
        Ok(Self {
            mixed: mixed_units(&balanced, &moments),
            windows: windows.with(balanced),
            inputs: moments.iter().map(|m| importance(&m.second, Side::Input)).collect(),
            outputs,
            alone,
            together: OnceLock::new(),
            moments: moments.into_iter().zip(output_moments).collect(),
            outputs_of,
        })
    }

    /// Returns the network with balanced columns.
    pub fn graph(&self) -> &Graph {
        &self.windows.graph
    }

    /// Returns the errors of removing each row of every matrix. Without learning those of single rows count: the gain of
    /// the others is small then, and small networks get more uneven errors.
    fn removals(&self, learns: bool) -> &[Option<Vec<f64>>] {
        let of_inputs: Vec<&Moments> = self.moments.iter().map(|(input, _)| input).collect();
        let together =
            || effects(self.graph(), &of_inputs, &self.outputs).map(|effect| Some(effect?.together())).collect();
        if learns { self.together.get_or_init(together) } else { &self.alone }
    }

    /// Returns the most steps of distillation with these options.
    pub fn most_steps(&self, options: &Options) -> usize {
        options.steps.unwrap_or_else(|| most_steps(&self.windows.graph, options.effort))
    }

    /// Returns the limits of learning.
    fn bounds(&self, options: &Options) -> Bounds {
        let most = self.most_steps(options);
        let steps = (options.steps.is_some() || options.minutes.is_none()).then_some(most);
        Bounds { steps, time: options.minutes.map(|minutes| Duration::from_secs_f64(60.0 * minutes)) }
    }
}

/// Returns the effect of every matrix's output; `None` if its rows cannot be removed.
fn effects(graph: &Graph, moments: &[&Moments], g: &[Vec<f64>]) -> impl Iterator<Item = Option<Effect>> {
    let dimensions = dimensions(graph);
    (0..graph.matrices.len()).map(move |m| Some(Effect::of(graph, Dimension::made_by(&dimensions, m)?, moments, g)))
}

/// Quantizes a network. The result lacks hidden elements without bits; its biases and norms have been learned.
pub fn quantize(
    statistics: &RowStatistics,
    rate: Rate,
    options: &Options,
    progress: &mut dyn FnMut(Progress),
) -> Result<QuantizedNetwork> {
    let RowStatistics { windows, inputs, outputs, moments, .. } = statistics;
    let graph = &windows.graph;
    for (name, _) in &options.forced {
        let names = || graph.matrices.iter().map(|m| m.name.as_str()).collect::<Vec<_>>().join(", ");
        ensure!(
            graph.matrices.iter().any(|m| m.name == *name),
            "no matrix is named {name:?}; the matrices are {}",
            names()
        );
    }
    let allowed = rate.bytes(graph.weights());
    let forced = forced(graph, rate, options);
    let dimensions = dimensions(graph);
    let removals = statistics.removals(options.learns());
    let rows: Vec<Rows> = graph
        .matrices
        .iter()
        .enumerate()
        .map(|(m, matrix)| {
            let energy = energies(matrix, &inputs[m], &outputs[m]);
            let removal = removals[m].clone().unwrap_or_else(|| energy.clone());
            Rows { energy, removal, forced: forced[m] }
        })
        .collect();
    let cycles = match rate {
        Rate::Within { cycles, .. } => Some(cycles),
        Rate::Width(_) | Rate::BitsPerWeight(_) | Rate::Bytes(_) => None,
    };
    let size = Size { cycles, ..Size::new(graph, &dimensions, values(graph, rate, options)) };
    let (widths, learned_with) = allocated(size.clone(), &rows, options, allowed)?;
    let input_moments: Vec<&Moments> = moments.iter().map(|(input, _)| input).collect();
    let compacted = compact(graph, &dimensions, &widths, &input_moments);
    let importance: Vec<Vec<f64>> = compacted
        .columns
        .iter()
        .zip(inputs)
        .map(|(columns, importance)| columns.iter().map(|&c| importance[c]).collect())
        .collect();
    let bounds = statistics.bounds(options);
    let task = Task {
        graph: &compacted.graph,
        widths: &compacted.widths,
        group: options.group,
        importance: &importance,
        x_max: &learned_with,
        widening: Widening::WIDE,
        frames: Frames::of(options, graph),
        bounds,
        seed: options.seed,
    };
    let feedback = |moments: &[(Moments, DMatrix<f64>)], damping: f64| {
        feed_back(&compacted, options.group, &importance, moments, damping)
    };
    let work = choosing(windows.recurrent());
    let Chosen { choice, bounds, tried } = choose(&task, windows, &feedback, &mut |share, error| {
        progress(Progress::Choosing { share: work * share, error });
    });
    let from = if tried.is_empty() { 0.0 } else { work };
    let (quantized, learned, steps) = match choice {
        Choice::Feedback { damping } => {
            let (quantized, graph) = feedback(moments, damping);
            (quantized, graph, 0)
        }
        Choice::Learning(widening) => {
            let Learned { quantized, graph, steps } =
                distill(&Task { widening, bounds, ..task }, windows, &mut |share, error| {
                    progress(Progress::Learning { share: from + (1.0 - from) * share, error });
                });
            (quantized, graph, steps)
        }
    };
    let wanted = match options.activations {
        Activations::Auto => {
            let allowance = bounds.time.filter(|_| graph.denoising_steps() > 1).map(Allowance::of);
            choose_activations(&learned, &quantized, windows, &learned_with, allowance, options.seed)
        }
        _ => learned_with.clone(),
    };
    let outcome = |quantized: &Quantized, limit: u16| -> Result<Outcome> {
        Ok(Outcome { x_max: quantized.x_max(limit)?, quantized: quantized.clone(), error: None, allocation: None })
    };
    let mut outcomes: Vec<Outcome> =
        quantized.iter().zip(learned_with).map(|(q, limit)| outcome(q, limit)).collect::<Result<_>>()?;
    // int16 has another layout, which may pad more; use it if it still fits.
    for (m, &limit) in wanted.iter().enumerate() {
        let other = outcome(&quantized[m], limit)?;
        let total = size.beside(&widths) + outcomes.iter().map(Outcome::bytes).sum::<usize>() - outcomes[m].bytes()
            + other.bytes();
        if total as f64 <= allowed {
            outcomes[m] = other;
        }
    }
    for (m, ((outcome, rows), widths)) in outcomes.iter_mut().zip(rows).zip(widths).enumerate() {
        let expected = widths.iter().enumerate().map(|(r, width)| rows.expected(r, *width)).collect();
        let Rows { energy, removal, .. } = rows;
        let (rows, columns) = (compacted.rows[m].clone(), compacted.columns[m].clone());
        let allocation = RowAllocation { widths, energy, removal, expected, inputs: inputs[m].clone(), rows, columns };
        outcome.allocation = Some(allocation);
    }
    let learning = Some(Learning { steps, choice, tried });
    Ok(QuantizedNetwork { graph: learned, outcomes, learning })
}

/// Returns the width that is forced on every matrix, if any.
fn forced(graph: &Graph, rate: Rate, options: &Options) -> Vec<Option<Width>> {
    let named = |matrix: &WeightMatrix| options.forced.iter().find(|(name, _)| *name == matrix.name).map(|(_, w)| *w);
    let of_matrix = |matrix: &WeightMatrix| match rate {
        Rate::Width(width) => Some(width),
        Rate::BitsPerWeight(_) | Rate::Bytes(_) | Rate::Within { .. } => named(matrix),
    };
    graph.matrices.iter().map(of_matrix).collect()
}

/// Returns the number of values of the vectors that a rate counts.
fn values(graph: &Graph, rate: Rate, options: &Options) -> usize {
    match rate {
        Rate::Bytes(_) | Rate::Within { bytes: Some(_), .. } => graph.changed_values(options.learns()),
        Rate::Width(_) | Rate::BitsPerWeight(_) | Rate::Within { bytes: None, .. } => 0,
    }
}

/// Returns the fewest bytes that meet a rate. A balance does not count, since only the recording can require it.
pub(super) fn least_bytes(graph: &Graph, rate: Rate, options: &Options) -> usize {
    let dimensions = dimensions(graph);
    let size = Size::new(graph, &dimensions, values(graph, rate, options));
    activations::least_bytes(&size, options, &forced(graph, rate, options))
}

/// Quantizes without learning: every matrix by two-sided error feedback with the moments of its input and of its
/// output's derivative. The mean error goes into the biases.
fn feed_back(
    compacted: &Compacted,
    group: usize,
    importance: &[Vec<f64>],
    moments: &[(Moments, DMatrix<f64>)],
    damping: f64,
) -> (Vec<Quantized>, Graph) {
    let part = |second: &DMatrix<f64>, of: &[usize]| second.select_rows(of).select_columns(of);
    let mut graph = compacted.graph.clone();
    let one = |m: usize| {
        let (columns, (input, output)) = (&compacted.columns[m], &moments[m]);
        let input = Moments {
            second: part(&input.second, columns),
            mean: columns.iter().map(|&c| input.mean[c]).collect(),
            count: input.count,
        };
        let output = part(output, &compacted.rows[m]);
        let matrix = &compacted.graph.matrices[m];
        feedback(matrix, &compacted.widths[m], group, &importance[m], (&input, damping), &output)
    };
    let found: Vec<(Quantized, Vec<f32>)> = (0..graph.matrices.len()).into_par_iter().map(one).collect();
    let quantized = found.into_iter().enumerate().map(|(m, (quantized, shift))| {
        add_to_bias(&mut graph, m, &shift);
        quantized
    });
    (quantized.collect(), graph)
}
