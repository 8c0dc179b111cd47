//! Every operation of the executor, and of the f32 evaluator that calibration uses, against an interpreter of
//! policy.json in f64 that shares no code with them.
//!
//! A tensor's name in these policies ends with its shape ("w 8x5"); its values are random.

mod contract;
mod reference;

use std::collections::BTreeMap;

use actq::budget::{Budget, Rate};
use actq::emit;
use actq::graph::{Evaluator, NodeKind};
use actq::methods::{Activations, Method, Options, Outcome, quantize};
use actq::policy::Policy;
use actq::runtime::{ImageBuffer, with_head};
use actq_bench::golden::Random;
use actq_kernels::{Head, Width};
use anyhow::{Context, Result, ensure};
use serde_json::{Value, json};

use reference::Reference;
pub(crate) use reference::{Case, wide};

/// The step before which the test resets a run.
const RESET: usize = 25;

/// Largest error, over the RMS of the output, in units of activation rounding (1 / x_max). A product rounds each value
/// of its input by at most amax / (2 x_max), and the random matrices keep the variance, so one product has an error of
/// about 0.3 amax / x_max (one sigma), where amax is 2 to 4 RMS: one unit. Several products in a row, recurrence, and
/// the largest of a hundred samples or more make it ten. A wrong operation is off by hundreds.
const ROUNDING_UNITS: f64 = 20.0;

/// Error of rounding to f32, and of the functions themselves (`kernels/src/math/functions.rs`), after a few operations
/// without weights.
const F32: f64 = 2e-6;

/// [`F32`] after recurrence and a dozen operations with sums of some ten products.
const F32_DEEP: f64 = 2e-5;

/// The largest difference of two runs over the RMS of the second. A step takes an observation, and `true` to reset
/// before.
fn deviation(
    observations: &[Vec<f32>],
    mut run: impl FnMut(&[f32], bool) -> Result<Vec<f64>>,
    mut reference: impl FnMut(&[f64], bool) -> Vec<f64>,
) -> Result<f64> {
    let (mut largest, mut square, mut count) = (0f64, 0f64, 0f64);
    for (i, obs) in observations.iter().enumerate() {
        let expected = reference(&wide(obs), i == RESET);
        let given = run(obs, i == RESET).with_context(|| format!("step {i}"))?;
        ensure!(given.len() == expected.len(), "found {} values, expected {}", given.len(), expected.len());
        for (y, r) in given.iter().zip(&expected) {
            ensure!(y.is_finite(), "{y} at step {i}");
            largest = largest.max((y - r).abs());
            square += r * r;
            count += 1.0;
        }
    }
    let rms = (square / count).sqrt();
    ensure!(rms > 1e-3, "the reference output is too small to compare with");
    Ok(largest / rms)
}

fn rtn(policy: &Policy, group: usize) -> Result<Vec<Outcome>> {
    let (budget, rate) = (Budget::Width(Width::W8), Rate::Width(Width::W8));
    let options = Options { group, activations: Activations::Int16, ..Options::new(Method::Rtn, budget) };
    Ok(quantize(&policy.graph, None, rate, &options)?.1)
}

/// The largest error that activation rounding explains. Attention rounds queries, keys and values to int8.
fn bound(policy: &Policy, outcomes: &[Outcome]) -> f64 {
    let has_attention = policy.graph.nodes.iter().any(|node| matches!(node.kind, NodeKind::Attention(_)));
    let least = if has_attention { 1.0 / 127.0 } else { 0.0 };
    let part = outcomes.iter().map(|o| 1.0 / f64::from(o.x_max)).fold(least, f64::max);
    if part > 0.0 { ROUNDING_UNITS * part } else { F32 }
}

/// Runs `work` with a head over the quantized policy.
fn on_head<T>(policy: &Policy, outcomes: &[Outcome], work: impl FnOnce(&mut Head<'_, '_>) -> Result<T>) -> Result<T> {
    let buffer = ImageBuffer::new(&emit::image(policy, outcomes)?);
    with_head::<_, anyhow::Error>(buffer.image(&policy.dir)?, work)
}

/// Compares both implementations with the reference, on a policy of `ops`.
fn check(obs: usize, act: usize, ops: Value) -> Result<()> {
    let case = Case::new(json!({"name": "test", "obs_dim": obs, "act_dim": act, "ops": ops}))?;
    let policy = Policy::load(case.dir.path())?;
    let observations = case.observations();

    let mut evaluator = Evaluator::new(&policy.graph);
    let f32_run = |obs: &[f32], reset: bool| {
        if reset {
            evaluator.reset();
        }
        Ok(wide(&evaluator.step(obs, &mut |_, _| {})))
    };
    let off = deviation(&observations, f32_run, follow(case.reference()))?;
    let limit = if policy.graph.matrices.is_empty() { F32 } else { F32_DEEP };
    ensure!(off < limit, "the error of the f32 evaluator is {off:.2e}, limit {limit:.2e}");

    // `graph/ignored.rs` compares images of networks that ignore something.
    let groups: &[usize] = if case.has_all_of(&policy) { &[0, 32] } else { &[] };
    for &group in groups {
        let outcomes = rtn(&policy, group)?;
        let off = on_head(&policy, &outcomes, |head| {
            let run = |obs: &[f32], reset: bool| {
                if reset {
                    head.reset();
                }
                Ok(wide(head.infer(obs)?))
            };
            deviation(&observations, run, follow(case.dequantized(&policy, &outcomes)))
        })?;
        let limit = bound(&policy, &outcomes);
        ensure!(off < limit, "group {group}: the error of the executor is {off:.2e}, limit {limit:.2e}");
    }
    Ok(())
}

/// The reference in the form for [`deviation`].
fn follow(mut reference: Reference<'_>) -> impl FnMut(&[f64], bool) -> Vec<f64> {
    move |obs, reset| {
        if reset {
            reference.state.clear();
        }
        reference.step(obs)
    }
}

/// Declares tests that [`check`] a policy: its lengths of observation and action, and its ops.
macro_rules! checks {
    ($($name:ident: $obs:literal, $act:literal, $ops:tt;)*) => {
        $(
            #[test]
            fn $name() -> Result<()> {
                check($obs, $act, json!($ops))
            }
        )*
    };
}

checks! {
    functions_match_the_reference: 11, 88, [
        {"op": "relu", "input": "obs", "save": "a"},
        {"op": "elu", "input": "obs", "save": "b"},
        {"op": "silu", "input": "obs", "save": "c"},
        {"op": "gelu", "input": "obs", "save": "d"},
        {"op": "gelu", "approximate": "none", "input": "obs", "save": "e"},
        {"op": "gelu", "approximate": "tanh", "input": "obs", "save": "f"},
        {"op": "tanh", "input": "obs", "save": "g"},
        {"op": "sigmoid", "input": "obs", "save": "h"},
        {"op": "identity", "input": ["a", "b", "c", "d", "e", "f", "g", "h"]},
    ];

    normalize_accepts_either_clip_both_or_none: 7, 28, [
        {"op": "normalize", "mean": "m 7", "scale": "s 7", "input": "obs", "save": "a"},
        {"op": "normalize", "mean": "m 7", "scale": "s 7", "pre_clip": 1.5, "input": "obs", "save": "b"},
        {"op": "normalize", "mean": "m 7", "scale": "s 7", "clip": 0.7, "input": "obs", "save": "c"},
        {"op": "normalize", "mean": "n 7", "scale": "t 7", "pre_clip": 2.0, "clip": 1.0, "input": "obs", "save": "d"},
        {"op": "identity", "input": ["a", "b", "c", "d"]},
    ];

    slots_and_slices_are_concatenated_in_order: 12, 37, [
        {"op": "tanh", "input": "obs[3:10]", "save": "a"},
        {"op": "sigmoid", "input": ["a[:4]", "obs", "a[2:]", "a[:]"], "save": "b"},
        // A repeated name refers to the later value.
        {"op": "relu", "input": "b[7:14]", "save": "a"},
        {"op": "identity", "input": ["b", "a[1:2]", "obs[11:]", "a"]},
    ];

    add_accepts_observation_slots_and_itself: 6, 6, [
        {"op": "add", "with": "obs", "save": "twice"},
        {"op": "tanh", "save": "t"},
        {"op": "add", "with": "twice", "save": "s"},
        {"op": "add", "with": "s"},
        {"op": "add", "with": "t", "input": "s"},
        {"op": "add", "with": "obs"},
    ];

    a_policy_without_weights_returns_its_observation: 5, 5, [{"op": "identity"}];

    // One more and one less than quads, pairs, units and groups; one row, one column; with bias and without.
    linear_handles_all_remainders: 65, 40, [
        {"op": "linear", "w": "a 5x33", "b": "b 5", "input": "obs[:33]", "save": "a"},
        {"op": "linear", "w": "c 31x65", "input": "obs", "save": "b"},
        {"op": "linear", "w": "d 1x31", "b": "e 1", "save": "c"},
        {"op": "linear", "w": "f 6x1"},
        {"op": "identity", "input": ["a", "b", "c", "obs[:2]"], "save": "d"},
        {"op": "linear", "w": "g 40x39", "b": "h 40"},
    ];

    two_operations_may_share_a_matrix: 12, 12, [
        {"op": "linear", "w": "w 12x12", "b": "a 12", "save": "x"},
        {"op": "elu"},
        {"op": "linear", "w": "w 12x12", "b": "b 12"},
        {"op": "add", "with": "x"},
    ];

    values_in_use_survive_operations_in_place: 8, 58, [
        {"op": "linear", "w": "a 10x8", "b": "b 10", "save": "x"},
        {"op": "tanh", "save": "y"},
        {"op": "add", "with": "x", "save": "z"},
        {"op": "relu"},
        {"op": "add", "with": "y"},
        {"op": "layernorm", "w_ln": "c 10", "b_ln": "d 10"},
        {"op": "add", "with": "z"},
        {"op": "rmsnorm", "w_ln": "e 10", "save": "v"},
        {"op": "silu", "input": "x", "save": "u"},
        {"op": "gelu", "input": "x"},
        {"op": "add", "with": "u"},
        {"op": "identity", "input": ["x", "y", "z", "u", "v", "obs"]},
    ];

    attention_is_full_or_causal_over_the_tokens_of_an_evaluation: 12, 36, [
        {"op": "linear", "w": "q 24x12", "b": "qb 24", "save": "q"},
        {"op": "linear", "w": "k 12x12", "input": "obs", "save": "k"},
        {"op": "linear", "w": "v 12x12", "input": "obs", "save": "v"},
        {"op": "attention", "heads": 4, "kv_heads": 2, "dim": 2, "input": "q", "keys": "k", "values": "v", "save": "y"},
        {"op": "attention", "heads": 2, "dim": 3, "factor": 0.4, "causal": true, "input": "k", "keys": "v", "values": "k", "save": "c"},
        {"op": "identity", "input": ["y", "c"]},
    ];

    attention_keeps_the_last_tokens: 9, 8, [
        {"op": "linear", "w": "q 8x9", "save": "q"},
        {"op": "linear", "w": "k 4x9", "input": "obs", "save": "k"},
        {"op": "linear", "w": "v 4x9", "input": "obs", "save": "v"},
        {"op": "attention", "heads": 2, "kv_heads": 1, "dim": 4, "context": 5, "input": "q", "keys": "k", "values": "v"},
    ];

    two_lstms_run_in_series: 9, 5, [recurrent("lstm", 28, 9, 7, "first"), recurrent("lstm", 20, 7, 5, "second")];

    gru_runs_with_and_without_biases: 8, 5, [
        recurrent("gru", 18, 8, 6, "first"),
        {"op": "gru", "hidden": 5, "gates": "r,z,n", "w_ih": "w 15x6", "w_hh": "v 15x5"},
    ];
}

#[test]
fn norms_use_a_given_or_the_default_eps() -> Result<()> {
    // Clipped to 0.003 the variance is about the default eps, so that a wrong default is visible.
    let small = json!({"op": "normalize", "mean": "m 9", "scale": "s 9", "clip": 0.003, "input": "obs"});
    let ops = json!([
        {"op": "layernorm", "w_ln": "w 9", "b_ln": "b 9", "eps": 0.5, "input": "obs", "save": "a"},
        {"op": "layernorm", "w_ln": "w 9", "input": "obs", "save": "b"},
        {"op": "rmsnorm", "w_ln": "w 9", "eps": 0.5, "input": "obs", "save": "c"},
        small,
        {"op": "layernorm", "w_ln": "w 9", "b_ln": "b 9", "save": "d"},
        small,
        {"op": "rmsnorm", "w_ln": "w 9", "save": "e"},
        {"op": "identity", "input": ["a", "b", "c", "d", "e"]},
    ]);
    check(9, 45, ops)
}

fn recurrent(op: &str, rows: usize, cols: usize, hidden: usize, name: &str) -> Value {
    json!({
        "op": op, "hidden": hidden, "save": name,
        "w_ih": format!("{name}.ih {rows}x{cols}"), "w_hh": format!("{name}.hh {rows}x{hidden}"),
        "b_ih": format!("{name}.bi {rows}"), "b_hh": format!("{name}.bh {rows}"),
    })
}

#[test]
fn overwriting_a_recurrent_output_keeps_the_state() -> Result<()> {
    for (op, gates) in [("lstm", 4), ("gru", 3)] {
        let ops = json!([
            recurrent(op, gates * 6, 7, 6, "h"),
            {"op": "relu"},
            {"op": "add", "with": "h", "save": "a"},
            {"op": "sigmoid", "input": "h", "save": "b"},
            {"op": "layernorm", "w_ln": "w 6", "input": "h"},
            {"op": "add", "with": "a"},
            {"op": "tanh", "save": "c"},
            {"op": "identity", "input": ["h", "a", "b", "c"]},
        ]);
        check(7, 24, ops).context(op)?;
        // Nothing else reads the state here, so that working in place is tempting.
        let plain = json!([recurrent(op, gates * 6, 7, 6, "h"), {"op": "tanh"}]);
        check(7, 6, plain).context(op)?;
    }
    Ok(())
}

const FUNCTIONS: [&str; 6] = ["relu", "elu", "silu", "gelu", "tanh", "sigmoid"];

/// Some operations on earlier values, with repeated names.
fn drawn_ops(random: &mut Random, obs: usize, act: usize) -> Value {
    let mut slots = BTreeMap::from([("obs".to_owned(), obs)]);
    let mut ops = Vec::new();
    let mut len = obs;
    let count = 4 + random.below(10);
    for i in 0..count {
        let mut inputs = Vec::new();
        for _ in 0..random.below(4) {
            let (name, &whole) = slots.iter().nth(random.below(slots.len())).unwrap_or_else(|| unreachable!());
            let from = random.below(whole);
            let to = (from + 1 + random.below(12)).min(whole);
            inputs.push((format!("{name}[{from}:{to}]"), to - from));
            if random.below(2) == 0 && whole <= 12 {
                inputs.push((name.clone(), whole));
            }
        }
        if !inputs.is_empty() {
            len = inputs.iter().map(|part| part.1).sum();
        }
        let fitting: Vec<_> = slots.iter().filter(|slot| *slot.1 == len).map(|slot| slot.0.clone()).collect();
        let hidden = 1 + random.below(9);
        let (mut op, out) = match random.below(12) {
            0 | 1 => {
                (json!({"op": "linear", "w": format!("w{i} {hidden}x{len}"), "b": format!("b{i} {hidden}")}), hidden)
            }
            2 => (recurrent("lstm", 4 * hidden, len, hidden, &format!("l{i}")), hidden),
            3 => (recurrent("gru", 3 * hidden, len, hidden, &format!("g{i}")), hidden),
            4 => (
                json!({"op": "normalize", "mean": format!("m{i} {len}"), "scale": format!("s{i} {len}"), "clip": 2}),
                len,
            ),
            // A large eps: a norm over nearly equal values would magnify the rounding without bound.
            5 => (json!({"op": "layernorm", "w_ln": format!("w{i} {len}"), "eps": 0.2}), len),
            6 => (json!({"op": "rmsnorm", "w_ln": format!("w{i} {len}"), "eps": 0.2}), len),
            7..=9 if !fitting.is_empty() => (json!({"op": "add", "with": fitting[random.below(fitting.len())]}), len),
            _ => (json!({"op": FUNCTIONS[random.below(FUNCTIONS.len())]}), len),
        };
        if !inputs.is_empty() {
            op["input"] = inputs.into_iter().map(|part| part.0).collect();
        }
        len = out;
        let name = format!("v{}", random.below(5));
        op["save"] = json!(name);
        slots.insert(name, len);
        ops.push(op);
    }
    let all: Vec<&String> = slots.keys().collect();
    let total: usize = slots.values().sum();
    ops.push(json!({"op": "linear", "input": all, "w": format!("out {act}x{total}"), "b": format!("out {act}")}));
    ops.into()
}

#[test]
fn random_graphs_match_the_reference() -> Result<()> {
    let mut random = Random::new(3);
    for _ in 0..400 {
        let ops = drawn_ops(&mut random, 9, 4);
        check(9, 4, ops.clone()).with_context(|| format!("{ops:#}"))?;
    }
    Ok(())
}
