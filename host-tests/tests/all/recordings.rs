//! Recordings of whole policies: values outside their calibrated range, and windows that begin in a recorded state.

use std::path::Path;

use actq::data::{Dataset, Range, Recording, Sizes};
use actq::graph::ops::{Linear, Lstm};
use actq::graph::{Graph, Network, WeightMatrix, Weights, zero_state};
use actq::measure::eval::evaluate;
use actq::methods::Activations;
use actq::policy::Policy;
use actq::runtime::ImageBuffer;
use actq_bench::golden::Random;
use actq_bench::{rtn, shared_policies, ur3};
use actq_kernels::Width;
use anyhow::Result;
use ndarray::{Array2, Array3};

/// The share of held-out observations outside the calibrated range, and `true` if it deserves a warning.
fn outside(dir: &Path) -> Result<(f64, bool)> {
    let policy = Policy::load(dir)?;
    let read = |which: Recording| which.require(Some(dir), None, Sizes::of(&policy), "this test");
    let (range, heldout) = (Range::of(&read(Recording::Calib)?), read(Recording::Heldout)?);
    let outside = range.outside(&heldout);
    Ok((outside.outside as f64 / outside.frames as f64, range.warning(&heldout).is_some()))
}

#[test]
fn only_g1_leaves_its_calibrated_range() -> Result<()> {
    assert!(!outside(&ur3())?.1);
    let Some(policies) = shared_policies() else { return Ok(()) };
    for name in ["go1_mlp", "fetch_pickplace"] {
        assert!(!outside(&policies.join(name))?.1, "{name}");
    }
    let (share, warned) = outside(&policies.join("g1_lstm256"))?;
    assert!(warned && (share - 0.27).abs() < 0.005, "{share}");
    Ok(())
}

const OBS: usize = 6;
const HIDDEN: usize = 32;
const ACT: usize = 2;
const STEPS: usize = 200;
const WINDOW: usize = 5;

/// An LSTM with a long memory.
fn policy() -> Policy {
    let mut random = Random::new(11);
    let mut values = |n: usize| -> Vec<f32> { (0..n).map(|_| 0.4 * random.unit()).collect() };
    let mut graph = Graph::new(OBS);
    for (name, rows, cols) in [("ih", 4 * HIDDEN, OBS), ("hh", 4 * HIDDEN, HIDDEN), ("out", ACT, HIDDEN)] {
        graph.matrices.push(WeightMatrix { name: name.into(), rows, cols, data: values(rows * cols) });
    }
    let mut bias = values(4 * HIDDEN);
    // The forget gate is open.
    bias[HIDDEN..2 * HIDDEN].iter_mut().for_each(|b| *b += 3.0);
    graph.add(Lstm { hidden: HIDDEN, input: 0, state: 1, bias }, &[0]).expect("it fits");
    graph.add(Linear { matrix: 2, bias: values(ACT) }, &[1]).expect("it fits");
    Policy::of("lstm", graph)
}

#[test]
fn windows_start_from_their_recorded_state() -> Result<()> {
    let policy = policy();
    let graph = &policy.graph;
    let mut random = Random::new(12);
    let obs = Array3::from_shape_simple_fn((1, STEPS, OBS), || random.unit());
    let mut whole = Dataset { path: "whole".into(), obs: obs.clone(), action: None, length: vec![STEPS], state: None };
    whole.fill_actions(graph);

    // The f32 network's state before each window.
    let (network, weights, mut state) = (Network::new(graph), Weights::of(graph), zero_state(graph, 1));
    let mut states = Vec::new();
    for (step, row) in whole.episode(0).enumerate() {
        if step % WINDOW == 0 {
            states.extend(state.iter().flatten().flatten().copied());
        }
        network.forward(&weights, Array2::from_shape_vec((1, OBS), row)?, &mut state);
    }
    let windows = STEPS / WINDOW;
    let shaped =
        |array: &Array3<f32>| Array3::from_shape_vec((windows, WINDOW, array.dim().2), array.iter().copied().collect());
    let cut = Dataset {
        path: "cut".into(),
        obs: shaped(&obs)?,
        action: whole.action.as_ref().map(shaped).transpose()?,
        length: vec![WINDOW; windows],
        state: Some(Array2::from_shape_vec((windows, graph.state_len()), states)?),
    };
    let from_zero = Dataset { state: None, ..cut.clone() };

    let buffer = ImageBuffer::new(&rtn(&policy, Width::W8, 32, Activations::Int16)?);
    let nmse = |dataset: &Dataset| Ok::<_, anyhow::Error>(evaluate(buffer.image(Path::new("memory"))?, dataset)?.nmse);
    let (whole, cut, from_zero) = (nmse(&whole)?, nmse(&cut)?, nmse(&from_zero)?);
    assert!(cut < 2.0 * whole && from_zero > 100.0 * cut, "{whole}, {cut}, from zero {from_zero}");
    Ok(())
}
