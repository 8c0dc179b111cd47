//! The method distill gives the same error in any units of the observations and of the actions.

use actq::budget::Budget;
use actq::data::{Dataset, Recordings};
use actq::graph::ops::{Add, Concat, Linear, Lstm, Normalize, Pointwise, Span};
use actq::graph::{Graph, ValueId, WeightMatrix};
use actq::measure::eval;
use actq::methods::{Method, Options};
use actq::pipeline::quantize;
use actq::policy::Policy;
use actq::random::Random;
use actq_kernels::math::Function;
use anyhow::Result;
use ndarray::Array3;

const OBS: usize = 16;
const HIDDEN: usize = 128;
const ACTIONS: usize = 8;
/// Of the small network: 6,144 weights.
pub(super) const SMALL_OBS: usize = 24;
const SMALL_HIDDEN: usize = 64;
/// Errors may differ by the bytes of the operation that cancels the units.
const RATIO: f64 = 1.2;

/// The number of each observation's units per unit of the recording.
type Units = [f32];
/// A network that cancels the units where it first reads the observation.
type Build = fn(&Units) -> Result<Graph>;

/// A network under construction, with random weights.
struct Drawn {
    graph: Graph,
    random: Random,
}

impl Drawn {
    fn new() -> Self {
        Self::of_seed(OBS, 3)
    }

    fn of_seed(obs: usize, seed: u64) -> Self {
        Self { graph: Graph::new(obs), random: Random::new(seed) }
    }

    /// A matrix whose first columns cancel the units.
    fn matrix(&mut self, rows: usize, cols: usize, units: &[f32]) -> Result<usize> {
        let unit = |i: usize| units.get(i % cols).copied().unwrap_or(1.0);
        let deviation = 1.3 / (cols as f32).sqrt();
        let data = (0..rows * cols).map(|i| deviation * self.random.normal() / unit(i)).collect();
        Ok(self.graph.add_matrix(WeightMatrix { name: format!("{rows} x {cols}"), rows, cols, data })?)
    }

    fn linear(&mut self, value: ValueId, rows: usize, units: &[f32]) -> Result<ValueId> {
        let matrix = self.matrix(rows, self.graph.len_of(value), units)?;
        Ok(self.graph.add(Linear { matrix, bias: vec![0.1; rows] }, &[value])?)
    }

    fn hidden(&mut self, value: ValueId, units: &[f32]) -> Result<ValueId> {
        let value = self.linear(value, HIDDEN, units)?;
        Ok(self.graph.add(Pointwise(Function::Elu), &[value])?)
    }

    fn actions(mut self, value: ValueId) -> Result<Graph> {
        self.linear(value, ACTIONS, &[])?;
        Ok(self.graph)
    }
}

fn feed_forward(units: &Units) -> Result<Graph> {
    let mut drawn = Drawn::new();
    let first = drawn.hidden(0, units)?;
    let second = drawn.hidden(first, &[])?;
    drawn.actions(second)
}

fn normalizing(units: &Units) -> Result<Graph> {
    let mut drawn = Drawn::new();
    let scale = units.iter().map(|unit| 1.0 / unit).collect();
    let unit = Normalize { mean: vec![0.0; OBS], scale, pre_clip: f32::INFINITY, clip: 5.0 };
    let value = drawn.graph.add(unit, &[0])?;
    let first = drawn.hidden(value, &[])?;
    drawn.actions(first)
}

fn recurrent(units: &Units) -> Result<Graph> {
    const STATE: usize = HIDDEN / 2;
    let mut drawn = Drawn::new();
    let (input, state) = (drawn.matrix(4 * STATE, OBS, units)?, drawn.matrix(4 * STATE, STATE, &[])?);
    let value = drawn.graph.add(Lstm { hidden: STATE, input, state, bias: vec![0.1; 4 * STATE] }, &[0])?;
    drawn.actions(value)
}

/// Reads the observation a second time beside the hidden vector, in a residual block.
fn residual(units: &Units) -> Result<Graph> {
    let mut drawn = Drawn::new();
    let first = drawn.hidden(0, units)?;
    let spans = vec![Span { from: 0, len: OBS }, Span { from: 0, len: HIDDEN }];
    let both = drawn.graph.add(Concat(spans), &[0, first])?;
    let second = drawn.hidden(both, units)?;
    let sum = drawn.graph.add(Add, &[first, second])?;
    drawn.actions(sum)
}

/// A network in which constants of all observations take a twelfth of the bytes.
pub(super) fn small(units: &Units, seed: u64) -> Result<Graph> {
    let mut drawn = Drawn::of_seed(SMALL_OBS, seed);
    let mut value = 0;
    for units in [units, &[]] {
        let sums = drawn.linear(value, SMALL_HIDDEN, units)?;
        value = drawn.graph.add(Pointwise(Function::Elu), &[sums])?;
    }
    drawn.linear(value, ACTIONS, &[])?;
    Ok(drawn.graph)
}

/// Episodes of correlated observations.
pub(super) fn recorded(seed: u64, units: &Units, graph: &Graph) -> Dataset {
    const EPISODES: usize = 4;
    const STEPS: usize = 200;
    let mut random = Random::new(seed);
    let mut last = vec![0f32; units.len()];
    let obs = Array3::from_shape_fn((EPISODES, STEPS, units.len()), |(_, _, i)| {
        last[i] = 0.6 * last[i] + 0.8 * random.normal();
        last[i] * units[i]
    });
    let mut dataset =
        Dataset { path: "recorded.npz".into(), obs, action: None, length: vec![STEPS; EPISODES], state: None };
    dataset.fill_actions(graph);
    dataset
}

/// The held-out error at 3 bits per weight, with scales and padding.
fn error(build: Build, units: &Units, steps: usize) -> Result<f64> {
    error_of(build(units)?, units, 3.0, steps)
}

/// The held-out error of a network at a budget of bits per weight, with scales and padding.
fn error_of(graph: Graph, units: &Units, bits: f64, steps: usize) -> Result<f64> {
    let policy = Policy::of("units", graph);
    let recordings = Recordings { calib: Some(recorded(1, units, &policy.graph)), heldout: None };
    let options = Options { steps: Some(steps), ..Options::new(Method::Distill, Budget::BitsPerWeight(bits)) };
    let buffer = quantize(&policy, &recordings, &options, ())?.buffer();
    Ok(eval::evaluate(buffer.image("image".as_ref())?, &recorded(2, units, &policy.graph))?.nmse)
}

/// The first `count` observations in a unit `scale` times finer.
fn first(count: usize, scale: f32) -> [f32; OBS] {
    std::array::from_fn(|i| if i < count { scale } else { 1.0 })
}

fn keeps_its_error(build: Build, steps: usize, cases: &[(usize, f32)]) -> Result<()> {
    let usual = error(build, &first(0, 1.0), steps)?;
    for &(count, scale) in cases {
        let found = error(build, &first(count, scale), steps)?;
        assert!(found < RATIO * usual && usual < RATIO * found, "{count} times {scale:e}: {found:e}, else {usual:e}");
    }
    Ok(())
}

#[test]
fn units_do_not_change_the_error() -> Result<()> {
    let cases = [(1, 1e-6), (7, 30.0), (1, 1e3), (7, 1e6), (OBS, 1e-20), (OBS, 1e3)];
    for build in [feed_forward, normalizing, recurrent, residual] {
        keeps_its_error(build, 0, &cases)?;
    }
    Ok(())
}

/// Columns in a row keep the error in every network, scattered ones in the mean over the networks: there, constants of
/// most columns are stored, and one network's error varies by more than the ratio leaves.
#[test]
fn units_do_not_change_a_networks_error() -> Result<()> {
    let units = |scale: f32, is_scaled: &dyn Fn(usize) -> bool| -> Vec<f32> {
        (0..SMALL_OBS).map(|i| if is_scaled(i) { scale } else { 1.0 }).collect()
    };
    let mut random = Random::new(3);
    let mixed: Vec<f32> = (0..SMALL_OBS).map(|_| 10f32.powf(6.0 * random.unit())).collect();
    let mut cases = vec![("a unit each".to_owned(), mixed, false)];
    for (scale, counts) in [(1e3, [1, 8, 16]), (1e6, [4, 12, SMALL_OBS])] {
        for count in counts {
            let first = units(scale, &|i| i < count);
            cases.push((format!("{count} times {scale:e}"), first, count != 16));
        }
        for nth in [2, 4] {
            cases.push((format!("every {nth} times {scale:e}"), units(scale, &|i| i % nth == 0), false));
        }
    }
    let as_they_are = units(1.0, &|_| false);
    let seeds = 3..6;
    let error = |units: &Units, seed: u64| error_of(small(units, seed)?, units, 3.2, 0);
    let usual = seeds.clone().map(|seed| error(&as_they_are, seed)).collect::<Result<Vec<f64>>>()?;
    for (name, units, is_in_a_row) in cases {
        let found = seeds.clone().map(|seed| error(&units, seed)).collect::<Result<Vec<f64>>>()?;
        let ratios: Vec<f64> = found.iter().zip(&usual).map(|(found, usual)| found / usual).collect();
        let mean = ratios.iter().product::<f64>().powf(1.0 / ratios.len() as f64);
        assert!(mean < RATIO && 1.0 < RATIO * mean, "{name}: {ratios:?}");
        assert!(!is_in_a_row || ratios.iter().all(|ratio| *ratio < RATIO), "{name}: {ratios:?}");
    }
    Ok(())
}

#[test]
fn units_do_not_change_learning() -> Result<()> {
    for build in [feed_forward, recurrent] {
        keeps_its_error(build, 40, &[(1, 1e-6), (7, 1e3), (OBS, 1e20)])?;
    }
    Ok(())
}

/// People choose the units of actions, too.
#[test]
fn units_of_actions_do_not_change_learning() -> Result<()> {
    const STEPS: usize = 300;
    let scaled = |scale: f32| -> Result<f64> {
        let units = first(0, 1.0);
        let mut graph = feed_forward(&units)?;
        graph.matrices.last_mut().into_iter().flat_map(|matrix| &mut matrix.data).for_each(|weight| *weight *= scale);
        let last = graph.nodes.last_mut().into_iter().flat_map(|node| node.kind.vectors_mut());
        last.flatten().for_each(|bias| *bias *= scale);
        error_of(graph, &units, 1.5, STEPS)
    };
    let usual = scaled(1.0)?;
    for scale in [1e-6, 1e-3, 1e3] {
        let found = scaled(scale)?;
        assert!(found < 1.1 * usual && usual < 1.1 * found, "{scale:e}: {found:e}, else {usual:e}");
    }
    Ok(())
}

#[test]
fn powers_of_two_give_the_same_bits() -> Result<()> {
    for build in [feed_forward, recurrent, residual] {
        let [some, others] = [10, -50].map(|n| error(build, &first(5, 2f32.powi(n)), 10));
        assert_eq!(some?, others?);
    }
    Ok(())
}
