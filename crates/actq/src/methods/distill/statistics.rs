//! Statistics of a network over the recorded observations, for any number of budgets.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::sync::OnceLock;
use std::time::Duration;

use nalgebra::DMatrix;

use super::balance::{MixedUnits, balance, mixed_units};
use super::cut::Removable;
use super::dimension::{Dimension, dimensions};
use super::heads::{HeadUnits, Measured};
use super::removal::{Effect, Reading, even_layer_errors, in_place};
use super::schedule::{Bounds, most_steps};
use super::units::{Units, units};
use crate::calibrate::allowance::Allowance;
use crate::calibrate::imagined::Imagined;
use crate::calibrate::moments::Moments;
use crate::calibrate::sensitivity::{Side, importance, output_moments};
use crate::calibrate::windows::Windows;
use crate::data::Dataset;
use crate::error::{Result, ensure};
use crate::graph::ties::Ties;
use crate::graph::{Graph, WeightMatrix};
use crate::methods::options::Options;

/// Least frames to learn from.
pub const MIN_FRAMES: usize = 200;
/// Most held-out frames to watch.
const MAX_WATCHED_FRAMES: usize = 2048;
/// Seed of the statistics, the same for every budget.
const SEED: u64 = 1;

/// Statistics of the recorded observations, for any number of budgets.
#[derive(Debug)]
pub struct RowStatistics {
    /// The network with balanced columns, and the recorded observations.
    pub(super) windows: Windows,
    /// Importance of every matrix's columns; of its rows.
    pub(super) inputs: Vec<Vec<f64>>,
    pub(super) outputs: Vec<Vec<f64>>,
    /// Errors of removing each row of every matrix: one by one, and together when needed. `None`: use the rows'
    /// energies.
    alone: Vec<Option<Vec<f64>>>,
    together: OnceLock<Vec<Option<Vec<f64>>>>,
    /// Units with their errors of removal.
    removable: OnceLock<Removable>,
    /// Moments of every matrix's input, and `G`.
    pub(super) moments: Vec<(Moments, DMatrix<f64>)>,
    /// Held-out observations, to report the error on while something is learned.
    pub(super) watched: Option<Windows>,
    /// Frames or windows that `G` was taken over.
    pub(crate) outputs_of: usize,
    /// Matrices whose columns still have very different units.
    pub(crate) mixed: Vec<MixedUnits>,
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
        dataset.require_frames(MIN_FRAMES, "learning from fewer overfits")?;
        let every = if allowance.is_some() { dataset.frames().div_ceil(frames.max(1)) } else { 1 };
        let windows = Windows::new(graph.clone(), dataset, every);
        if windows.output_variance.iter().any(|v| !v.is_finite()) {
            dataset.require_finite(graph)?;
        }
        ensure!(
            windows.output_variance.iter().any(|v| *v > 0.0),
            "{}: the policy gives the same action at every observation; record observations with different actions",
            dataset.path.display()
        );
        let (output_moments, outputs_of) = output_moments(&windows, allowance, SEED);
        let outputs: Vec<Vec<f64>> = output_moments.iter().map(|g| importance(g, Side::Output)).collect();
        let balanced = balance(graph, &mut moments, &outputs)?;
        let of_inputs: Vec<&Moments> = moments.iter().collect();
        let alone = removals(&balanced, &of_inputs, &outputs, Effect::alone);
        let mut windows = windows.with(balanced);
        windows.imagine(SEED);
        Ok(Self {
            mixed: mixed_units(&windows.graph, &moments),
            windows,
            inputs: moments.iter().map(|m| importance(&m.second, Side::Input)).collect(),
            outputs,
            alone,
            together: OnceLock::new(),
            removable: OnceLock::new(),
            watched: None,
            moments: moments.into_iter().zip(output_moments).collect(),
            outputs_of,
        })
    }

    /// Reports errors on some of a held-out recording while something is learned.
    pub fn watch(&mut self, held_out: &Dataset) {
        let graph = self.graph().clone();
        let some = held_out.thinned(MAX_WATCHED_FRAMES / graph.denoising_steps(), graph.state_len() > 0);
        self.watched = (some.frames() > 0).then(|| Windows::new(graph, &some, 1));
    }

    /// Returns the imagined rollouts; `None` without a model of the robot.
    pub fn imagined(&self) -> Option<&Imagined> {
        self.windows.imagined.as_ref()
    }

    /// Returns the network with balanced columns.
    pub fn graph(&self) -> &Graph {
        &self.windows.graph
    }

    /// Returns each row's error of removal; `None`: use its energy. Without learning, errors of single rows apply:
    /// joint errors gain little then, and make those of small networks more uneven. If `even`, the errors of rows that
    /// disappear are [`even_layer_errors`].
    pub(super) fn removals(&self, learns: bool, even: bool) -> Cow<'_, [Option<Vec<f64>>]> {
        let of_inputs: Vec<&Moments> = self.moments.iter().map(|(input, _)| input).collect();
        let together = || removals(self.graph(), &of_inputs, &self.outputs, Effect::together);
        let measured = if learns { self.together.get_or_init(together) } else { &self.alone };
        if !even {
            return measured.into();
        }
        let mut removals = measured.to_vec();
        for Dimension { maker, .. } in dimensions(self.graph()) {
            removals[maker] = measured[maker].as_ref().map(|of| even_layer_errors(of, self.mean_action_error()));
        }
        removals.into()
    }

    /// Returns the units with their errors of removal, [`even_layer_errors`] if `even`. Heads keep theirs: without one,
    /// what was added to its output remains.
    pub(super) fn removable(&self, even: bool) -> Cow<'_, Removable> {
        let measured = self.removable.get_or_init(|| {
            let (graph, ties, g) = (self.graph(), Ties::of(self.graph()), &self.outputs);
            let moments: &[&Moments] = &self.moments.iter().map(|(input, _)| input).collect::<Vec<_>>();
            let with_removals = |units: Units| {
                let removals = units.removals(graph, moments, g);
                (units, removals)
            };
            let heads = HeadUnits::of(graph, &ties, Some(Measured { moments, g, constant: &self.alone }));
            Removable { units: units(graph, &ties).into_iter().map(with_removals).collect(), heads }
        });
        if !even {
            return Cow::Borrowed(measured);
        }
        let mut evened = measured.clone();
        for (_, removals) in &mut evened.units {
            *removals = even_layer_errors(removals, self.mean_action_error());
        }
        Cow::Owned(evened)
    }

    /// Returns the error of a network that always gives the mean action.
    fn mean_action_error(&self) -> f64 {
        self.windows.output_variance.iter().filter(|variance| **variance > 0.0).count() as f64
    }

    /// Returns the most steps of distillation with these options.
    pub fn most_steps(&self, options: &Options) -> usize {
        options.steps.unwrap_or_else(|| most_steps(&self.windows.graph, options.effort))
    }

    /// Returns the limits of learning.
    pub(super) fn bounds(&self, options: &Options) -> Bounds {
        let most = self.most_steps(options);
        let steps = (options.steps.is_some() || options.minutes.is_none()).then_some(most);
        Bounds { steps, time: options.minutes.map(|minutes| Duration::from_secs_f64(60.0 * minutes)) }
    }
}

/// Returns the errors of removal of every matrix's rows: by `of` if the rows disappear, else by their output's
/// variance. `None` for the gates of a cell: a gate is the sum of two products, and one can learn to replace the
/// other's part.
fn removals(graph: &Graph, moments: &[&Moments], g: &[Vec<f64>], of: fn(&Effect) -> Vec<f64>) -> Vec<Option<Vec<f64>>> {
    let dimensions = dimensions(graph);
    let cells = graph.nodes.iter().map(|node| node.kind.products()).filter(|products| products.len() > 1);
    let gates: BTreeSet<usize> = cells.flatten().map(|product| product.matrix).collect();
    let of_matrix = |(m, matrix): (usize, &WeightMatrix)| match Dimension::made_by(&dimensions, m) {
        Some(dimension) => {
            let reading = Reading { matrices: dimension.consumers.clone(), columns: 0..matrix.rows };
            Some(of(&Effect::of(graph, &reading, moments, g)))
        }
        None => (!gates.contains(&m)).then(|| in_place(matrix, moments[m], &g[m])),
    };
    graph.matrices.iter().enumerate().map(of_matrix).collect()
}
