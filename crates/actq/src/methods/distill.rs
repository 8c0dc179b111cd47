//! The method distill. It measures how much every row matters, gives each a width within the budget, and removes rows
//! of width 0. Then it distills, or, with 0 steps, uses two-sided error feedback.

pub mod activations;
pub mod adam;
pub mod allocate;
pub mod balance;
mod candidate;
pub mod choose;
pub mod compact;
mod cut;
pub mod dimension;
pub mod feedback;
mod heads;
mod latent;
pub mod lessons;
pub mod objective;
pub mod removal;
pub mod schedule;
mod shape;
pub mod size;
mod statistics;
pub mod train;
mod trials;
mod units;

pub use statistics::{MIN_FRAMES, RowStatistics};

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::learning::{Choice, Learning, Recipe, Trial};
use super::options::Options;
use super::packing::Activations;
use super::progress::Progress;
use super::quantized::{Outcome, Quantized, QuantizedNetwork, RowAllocation};
use crate::budget::Rate;
use crate::calibrate::allowance::Allowance;
use crate::calibrate::moments::Moments;
use crate::calibrate::sensitivity::DAMPING_INPUT;
use crate::calibrate::widening::Widening;
use crate::error::{Result, ensure};
use crate::graph::Graph;
use activations::choose_activations;
use allocate::Rows;
use candidate::Candidate;
use choose::{Chosen, choose, errors};
use compact::add_to_bias;
use feedback::feedback;
use schedule::Bounds;
use shape::{Shape, Target, values};
use size::Size;
use train::{Baseline, Task, TrainResult, distill};
use trials::choose_recipe;

/// Quantizes a network. The result lacks hidden elements without bits; its biases and norms have been learned.
pub fn quantize(
    statistics: &RowStatistics,
    rate: Rate,
    options: &Options,
    progress: &mut dyn FnMut(Progress),
) -> Result<QuantizedNetwork> {
    check_names(&statistics.windows.graph, options)?;
    let goal = Target { statistics, rate, options };
    let (candidate, chosen) = choose_candidate(goal, progress)?;
    let bounds = chosen.bounds;
    let (TrainResult { quantized, graph: learned, .. }, learning) = learn(goal, &candidate, chosen, progress);
    let outcomes = outcomes(goal, &candidate, &learned, &quantized, bounds)?;
    let cycles = candidate.shape.cycles;
    let outcomes = with_allocations(statistics, candidate, outcomes);
    Ok(QuantizedNetwork { graph: learned, outcomes, learning: Some(learning), cycles })
}

/// Refuses a forced width for a matrix that the network does not have.
fn check_names(graph: &Graph, options: &Options) -> Result<()> {
    for (name, _) in &options.forced {
        let names = || graph.matrices.iter().map(|m| m.name.as_str()).collect::<Vec<_>>().join(", ");
        ensure!(
            graph.matrices.iter().any(|m| m.name == *name),
            "no matrix is named {name:?}; the matrices are {}",
            names()
        );
    }
    Ok(())
}

/// Chooses the network to quantize, and learning or feedback.
fn choose_candidate(goal: Target<'_>, progress: &mut dyn FnMut(Progress)) -> Result<(Candidate, Chosen)> {
    let Target { statistics: RowStatistics { windows, .. }, options, .. } = goal;
    let usual = Recipe::new(Widening::of(windows.recurrent()));
    let recipe = options.choice.and_then(Choice::recipe).unwrap_or(usual);
    let mut choosing = |share, error| progress(Progress::Choosing { share, error });
    let first = Candidate::new(goal, recipe)?;
    if let Some(choice) = options.choice {
        return Ok((first, Chosen::untried(choice, goal.statistics.bounds(options))));
    }
    if options.learns() && first.task(goal, recipe).has_lost_half(windows) {
        return Ok(choose_recipe(goal, first, recipe, &mut choosing));
    }
    let feedback =
        |moments: &[(Moments, DMatrix<f64>)], damping: f64| feed_back(&first, options.group, moments, damping);
    let chosen = choose(&first.task(goal, recipe), windows, &feedback, &mut choosing);
    Ok((first, chosen))
}

/// Learns, or takes two-sided error feedback; also feedback if learning has made the network worse.
fn learn(
    goal: Target<'_>,
    candidate: &Candidate,
    Chosen { choice, bounds, mut tried, share: from }: Chosen,
    progress: &mut dyn FnMut(Progress),
) -> (TrainResult, Learning) {
    let Target { statistics: RowStatistics { windows, moments, .. }, options, .. } = goal;
    let fed_back = |damping: f64| {
        let (quantized, graph) = feed_back(candidate, options.group, moments, damping);
        TrainResult { quantized, graph, steps: 0 }
    };
    let recipe = match choice {
        Choice::Feedback { damping } => {
            return (fed_back(damping), Learning { steps: 0, discarded: 0, choice, tried });
        }
        Choice::Learning(recipe) => recipe,
    };
    let task = Task { bounds, ..candidate.task(goal, recipe) };
    let learned = distill(&task, windows, &mut |Baseline { share, error, held_out }| {
        progress(Progress::Learning { share: from + (1.0 - from) * share, error, held_out });
    });
    let before = fed_back(DAMPING_INPUT);
    let damping = Choice::Feedback { damping: DAMPING_INPUT };
    let [after, start, feedback] =
        [(choice, &learned), (choice, &task.start()), (damping, &before)].map(|(choice, of)| {
            let [recorded, widened] = errors(&task, &of.graph, &of.quantized, windows);
            Trial { choice, recorded, widened }
        });
    if is_kept(&after, &start, &feedback) {
        let learning = Learning { steps: learned.steps, discarded: 0, choice, tried };
        return (learned, learning);
    }
    tried.extend([after, feedback]);
    (before, Learning { steps: 0, discarded: learned.steps, choice: damping, tried })
}

/// `true` if learning has not raised the error of what it started from, nor is feedback better. Feedback fits the
/// recorded observations more closely than others, so it has to be better at the widened ones, too. An error that is
/// not a number counts as higher.
fn is_kept(learned: &Trial, start: &Trial, feedback: &Trial) -> bool {
    learned.recorded <= start.recorded && (learned.recorded <= feedback.recorded || learned.widened <= feedback.widened)
}

/// Returns the matrices with the activations that they get: int16 has another layout, which may pad more, so a matrix
/// gets it only if it still fits.
fn outcomes(
    Target { statistics, rate, options }: Target<'_>,
    candidate: &Candidate,
    learned: &Graph,
    quantized: &[Quantized],
    bounds: Bounds,
) -> Result<Vec<Outcome>> {
    let (graph, windows) = (statistics.graph(), &statistics.windows);
    let Shape { cut, dimensions, widths, limits: learned_with, .. } = &candidate.shape;
    let size = Size::new(&cut.graph, dimensions, values(&cut.graph, rate, options));
    let allowed = rate.bytes(graph.weights());
    let wanted = match options.activations {
        Activations::Auto => {
            let allowance = bounds.time.filter(|_| graph.denoising_steps() > 1).map(Allowance::of);
            choose_activations(learned, quantized, windows, learned_with, allowance, options.seed)
        }
        _ => learned_with.clone(),
    };
    let outcome = |quantized: &Quantized, limit: u16| -> Result<Outcome> {
        Ok(Outcome { x_max: quantized.x_max(limit)?, quantized: quantized.clone(), error: None, allocation: None })
    };
    let mut outcomes: Vec<Outcome> =
        quantized.iter().zip(learned_with).map(|(q, &limit)| outcome(q, limit)).collect::<Result<_>>()?;
    for (m, &limit) in wanted.iter().enumerate() {
        let other = outcome(&quantized[m], limit)?;
        let total = size.beside(widths) + outcomes.iter().map(Outcome::bytes).sum::<usize>() - outcomes[m].bytes()
            + other.bytes();
        if total as f64 <= allowed {
            outcomes[m] = other;
        }
    }
    Ok(outcomes)
}

/// Adds the reasons for the widths to the matrices. The rows of removed units count as rows without bits.
fn with_allocations(statistics: &RowStatistics, candidate: Candidate, mut outcomes: Vec<Outcome>) -> Vec<Outcome> {
    let Candidate { shape: Shape { cut, rows, widths, .. }, compacted, .. } = candidate;
    for (m, ((outcome, rows), widths)) in outcomes.iter_mut().zip(rows).zip(widths).enumerate() {
        let expected = widths.iter().enumerate().map(|(r, width)| rows.expected(r, *width)).collect();
        let Rows { energy, removal, .. } = rows;
        let [removal, expected] = [removal, expected].map(|of: Vec<f64>| cut.expand(m, of, cut.error_of_row()));
        let energy = cut.expand(m, energy, 0.0);
        let widths = cut.expand(m, widths, None);
        let (rows, columns) = (compacted.rows[m].clone(), compacted.columns[m].clone());
        let inputs = statistics.inputs[m].clone();
        outcome.allocation = Some(RowAllocation { widths, energy, removal, expected, inputs, rows, columns });
    }
    outcomes
}

/// Returns the fewest bytes that meet a rate. A balance does not count, since only the recording can require it.
pub(super) fn least_bytes(graph: &Graph, rate: Rate, options: &Options) -> usize {
    shape::least_bytes(graph, rate, options)
}

/// Quantizes without learning: every matrix by two-sided error feedback with the moments of its input and of its
/// output's derivative. The mean error goes into the biases.
fn feed_back(
    Candidate { compacted, importance, .. }: &Candidate,
    group: usize,
    moments: &[(Moments, DMatrix<f64>)],
    damping: f64,
) -> (Vec<Quantized>, Graph) {
    let mut graph = compacted.graph.clone();
    let one = |m: usize| {
        let (columns, (input, output)) = (&compacted.columns[m], &moments[m]);
        let (input, rows) = (input.of(columns), &compacted.rows[m]);
        let output = output.select_rows(rows).select_columns(rows);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn learning_counts_only_if_it_lowers_the_error() {
        let tried =
            |recorded, widened| Trial { choice: Choice::Feedback { damping: DAMPING_INPUT }, recorded, widened };
        let (start, feedback) = (tried(1.0, 2.0), tried(0.5, 1.0));
        let kept = |recorded, widened| is_kept(&tried(recorded, widened), &start, &feedback);
        assert!(kept(0.4, 0.9) && kept(0.4, 1.1), "lower at the recorded observations");
        assert!(kept(0.6, 0.9), "feedback fits the recorded observations more closely than others");
        assert!(!kept(0.6, 1.1), "feedback is better");
        assert!(!kept(1.1, 0.9), "higher than before learning");
        assert!(!kept(f64::NAN, 0.1) && !kept(f64::INFINITY, 0.1));
    }
}
