//! Every operation of the executor, and the f32 evaluator that calibration uses, against an interpreter of policy.json in f64
//! that shares no code with them.
//!
//! A tensor's name in these policies ends with its shape ("w 8x5"); its values are drawn.

use std::collections::BTreeMap;
use std::fs;

use actq::budget::{Budget, Rate};
use actq::emit;
use actq::graph::Evaluator;
use actq::methods::{Activations, Method, Options, Outcome, quantize};
use actq::policy::Policy;
use actq::runtime::{ImageBuffer, with_head};
use actq_bench::golden::Random;
use actq_kernels::{Head, Width};
use anyhow::{Context, Result, ensure};
use safetensors::Dtype;
use safetensors::tensor::{TensorView, serialize};
use serde_json::{Value, json};
use tempfile::TempDir;

/// Steps of a run, and the step before which it is reset.
const STEPS: usize = 40;
const RESET: usize = 25;

/// Observations reach from minus to plus this: beyond every clip, into the tails of every function.
const REACH: f32 = 4.0;

/// Largest error, over the RMS of the output, in parts of activation rounding (1 / x_max). A product rounds each value of its
/// input by at most amax / (2 x_max), and the drawn matrices keep the variance, so one product is off by about
/// 0.3 amax / x_max (one sigma), amax being 2 to 4 RMS: one part. Several products in a row, recurrence, and the largest of a
/// hundred samples or more make it ten. A wrong operation is off by hundreds.
const PARTS: f64 = 20.0;

/// What rounding to f32 and the functions' own errors (math.rs) leave of a few operations without weights.
const F32: f64 = 2e-6;

/// [`F32`] through recurrence and a dozen operations with sums of some ten products.
const F32_DEEP: f64 = 2e-5;

type Tensors = BTreeMap<String, (Vec<usize>, Vec<f32>)>;

/// A policy on disk and in its parts.
pub(crate) struct Case {
    pub(crate) dir: TempDir,
    json: Value,
    tensors: Tensors,
}

impl Case {
    /// Writes the policy with drawn tensors: matrices that keep the variance of their input, vectors within -1 to 1.
    pub(crate) fn new(json: Value) -> Result<Self> {
        let keys = ["w", "b", "mean", "scale", "w_ln", "b_ln", "w_ih", "w_hh", "b_ih", "b_hh"];
        let mut random = Random::new(1);
        let mut tensors = Tensors::new();
        let of_ops = ops(&json).iter().flat_map(|op| keys.iter().filter_map(|key| op.get(key)?.as_str()));
        for name in of_ops.chain(json["time"]["freq"].as_str()) {
            let shape =
                name.split(' ').next_back().unwrap_or("").split('x').map(str::parse).collect::<Result<Vec<_>, _>>();
            let shape: Vec<usize> = shape.with_context(|| format!("{name}: no shape"))?;
            let reach = if let [_, cols] = shape[..] { (3.0 / cols as f32).sqrt() } else { 1.0 };
            let values = (0..shape.iter().product()).map(|_| reach * random.unit()).collect();
            tensors.entry(name.to_owned()).or_insert((shape, values));
        }
        let bytes: BTreeMap<_, Vec<u8>> =
            tensors.iter().map(|(name, (_, v))| (name, v.iter().flat_map(|v| v.to_le_bytes()).collect())).collect();
        let views = tensors
            .iter()
            .map(|(name, (shape, _))| Ok((name, TensorView::new(Dtype::F32, shape.clone(), &bytes[name])?)))
            .collect::<Result<Vec<_>>>()?;
        let dir = TempDir::new()?;
        fs::write(dir.path().join("policy.safetensors"), serialize(views, None)?)?;
        fs::write(dir.path().join("policy.json"), json.to_string())?;
        Ok(Self { dir, json, tensors })
    }

    pub(crate) fn reference(&self) -> Reference<'_> {
        let values = |(name, (_, v)): (&'_ String, &(Vec<usize>, Vec<f32>))| (name.clone(), wide(v));
        Reference { ops: ops(&self.json), tensors: self.tensors.iter().map(values).collect(), state: BTreeMap::new() }
    }

    /// The reference with the weights that the codes stand for.
    fn dequantized(&self, policy: &Policy, outcomes: &[Outcome]) -> Reference<'_> {
        let mut reference = self.reference();
        for (matrix, outcome) in policy.graph.matrices.iter().zip(outcomes) {
            reference.tensors.insert(matrix.name.clone(), wide(&outcome.quantized.dequantized()));
        }
        reference
    }

    fn observations(&self) -> Vec<Vec<f32>> {
        let mut random = Random::new(2);
        let len = self.json["obs_dim"].as_u64().unwrap_or(0);
        (0..STEPS).map(|_| (0..len).map(|_| REACH * random.unit()).collect()).collect()
    }
}

fn ops(json: &Value) -> &[Value] {
    json["ops"].as_array().map_or(&[], |ops| ops)
}

pub(crate) fn wide(values: &[f32]) -> Vec<f64> {
    values.iter().map(|&v| f64::from(v)).collect()
}

/// policy.json, interpreted.
pub(crate) struct Reference<'a> {
    ops: &'a [Value],
    pub(crate) tensors: BTreeMap<String, Vec<f64>>,
    /// Hidden and cell state by the op's position.
    state: BTreeMap<usize, [Vec<f64>; 2]>,
}

impl Reference<'_> {
    fn step(&mut self, obs: &[f64]) -> Vec<f64> {
        self.run(BTreeMap::from([("obs", obs.to_vec())]))
    }

    /// The ops over these slots; the first op takes the slot `obs` where it names none.
    pub(crate) fn run<'s>(&'s mut self, mut slots: BTreeMap<&'s str, Vec<f64>>) -> Vec<f64> {
        let mut x = slots["obs"].clone();
        for (i, op) in self.ops.iter().enumerate() {
            x = match &op["input"] {
                Value::String(text) => part(&slots, text),
                Value::Array(texts) => texts.iter().flat_map(|t| part(&slots, t.as_str().unwrap_or(""))).collect(),
                _ => x,
            };
            let tensor = |key: &str| op[key].as_str().map(|name| &self.tensors[name][..]);
            let product = |w: &str, b: &str, x: &[f64]| affine(tensor(w).unwrap_or(&[]), x, tensor(b));
            let number = |key: &str, default: f64| op[key].as_f64().unwrap_or(default);
            let hidden = number("hidden", 0.0) as usize;
            let [h, c] = self.state.entry(i).or_insert_with(|| [vec![0.0; hidden], vec![0.0; hidden]]);
            x = match op["op"].as_str().unwrap_or("") {
                "identity" => x,
                "normalize" => {
                    let (pre, post) = (number("pre_clip", f64::INFINITY), number("clip", f64::INFINITY));
                    let (mean, scale) = (tensor("mean").unwrap_or(&[]), tensor("scale").unwrap_or(&[]));
                    let normal = |i: usize| (x[i].clamp(-pre, pre) - mean[i]) * scale[i];
                    (0..x.len()).map(|i| normal(i).clamp(-post, post)).collect()
                }
                "linear" => product("w", "b", &x),
                "layernorm" => {
                    let mean = x.iter().sum::<f64>() / x.len() as f64;
                    let centred: Vec<f64> = x.iter().map(|v| v - mean).collect();
                    let normal = unit(&centred, number("eps", 1e-5));
                    let scaled = scale(&normal, tensor("w_ln").unwrap_or(&[]));
                    tensor("b_ln").map_or(scaled.clone(), |b| sum(&scaled, b))
                }
                "rmsnorm" => scale(&unit(&x, number("eps", 1e-6)), tensor("w_ln").unwrap_or(&[])),
                "add" => sum(&x, &slots[op["with"].as_str().unwrap_or("")]),
                "lstm" => {
                    let gates = sum(&product("w_ih", "b_ih", &x), &product("w_hh", "b_hh", h));
                    for j in 0..hidden {
                        let [i, f, g, o] = [0, 1, 2, 3].map(|k| gates[k * hidden + j]);
                        c[j] = sigmoid(f) * c[j] + sigmoid(i) * g.tanh();
                        h[j] = sigmoid(o) * c[j].tanh();
                    }
                    h.clone()
                }
                "gru" => {
                    let (a, b) = (product("w_ih", "b_ih", &x), product("w_hh", "b_hh", h));
                    for j in 0..hidden {
                        let [r, z] = [0, 1].map(|k| sigmoid(a[k * hidden + j] + b[k * hidden + j]));
                        let n = (a[2 * hidden + j] + r * b[2 * hidden + j]).tanh();
                        h[j] = (1.0 - z) * n + z * h[j];
                    }
                    h.clone()
                }
                name => x.iter().map(|&v| function(name, op["approximate"] == "tanh", v)).collect(),
            };
            if let Some(name) = op["save"].as_str() {
                slots.insert(name, x.clone());
            }
        }
        x
    }
}

/// The values of `name` or `name[from:to]`.
fn part(slots: &BTreeMap<&str, Vec<f64>>, text: &str) -> Vec<f64> {
    let Some((name, range)) = text.split_once('[') else { return slots[text].clone() };
    let (from, to) = range.trim_end_matches(']').split_once(':').unwrap_or_default();
    slots[name][from.parse().unwrap_or(0)..to.parse().unwrap_or(slots[name].len())].to_vec()
}

fn affine(w: &[f64], x: &[f64], b: Option<&[f64]>) -> Vec<f64> {
    let rows = w.chunks_exact(x.len()).map(|row| row.iter().zip(x).map(|(w, x)| w * x).sum());
    let product: Vec<f64> = rows.collect();
    b.map_or(product.clone(), |b| sum(&product, b))
}

fn sum(a: &[f64], b: &[f64]) -> Vec<f64> {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| a + b).collect()
}

fn scale(x: &[f64], factors: &[f64]) -> Vec<f64> {
    x.iter().zip(factors).map(|(x, w)| x * w).collect()
}

/// `x / sqrt(mean(x^2) + eps)`
fn unit(x: &[f64], eps: f64) -> Vec<f64> {
    let size = (x.iter().map(|v| v * v).sum::<f64>() / x.len() as f64 + eps).sqrt();
    x.iter().map(|v| v / size).collect()
}

fn sigmoid(x: f64) -> f64 {
    1.0 / (1.0 + (-x).exp())
}

fn function(name: &str, approximate: bool, x: f64) -> f64 {
    match name {
        "relu" => x.max(0.0),
        "elu" if x < 0.0 => x.exp() - 1.0,
        "elu" => x,
        "silu" => x * sigmoid(x),
        "gelu" if approximate => {
            0.5 * x * (1.0 + ((2.0 / std::f64::consts::PI).sqrt() * (x + 0.044715 * x.powi(3))).tanh())
        }
        "gelu" => 0.5 * x * (1.0 + erf(x / 2f64.sqrt())),
        "tanh" => x.tanh(),
        "sigmoid" => sigmoid(x),
        other => panic!("the reference has no op {other}"),
    }
}

/// `2 / sqrt(pi) exp(-x^2) sum 2^n x^(2n+1) / (2n+1)!!`; no term cancels another. From 6 on it is 1 to the last bit.
fn erf(x: f64) -> f64 {
    let x = x.clamp(-6.0, 6.0);
    let terms = (1..200).scan(x, |term, n| {
        *term *= 2.0 * x * x / f64::from(2 * n + 1);
        Some(*term)
    });
    2.0 / std::f64::consts::PI.sqrt() * (-x * x).exp() * (x + terms.sum::<f64>())
}

/// The largest difference of two runs over the RMS of the second. A step takes an observation and whether to reset before.
fn deviation(
    observations: &[Vec<f32>],
    mut run: impl FnMut(&[f32], bool) -> Result<Vec<f64>>,
    mut reference: impl FnMut(&[f64], bool) -> Vec<f64>,
) -> Result<f64> {
    let (mut largest, mut square, mut count) = (0f64, 0f64, 0f64);
    for (i, obs) in observations.iter().enumerate() {
        let expected = reference(&wide(obs), i == RESET);
        let given = run(obs, i == RESET).with_context(|| format!("step {i}"))?;
        ensure!(given.len() == expected.len(), "{} values instead of {}", given.len(), expected.len());
        for (y, r) in given.iter().zip(&expected) {
            ensure!(y.is_finite(), "{y} at step {i}");
            largest = largest.max((y - r).abs());
            square += r * r;
            count += 1.0;
        }
    }
    let rms = (square / count).sqrt();
    ensure!(rms > 1e-3, "the reference gives nothing to compare with");
    Ok(largest / rms)
}

fn rtn(policy: &Policy, group: usize) -> Result<Vec<Outcome>> {
    let (budget, rate) = (Budget::Width(Width::W8), Rate::Width(Width::W8));
    let options = Options { group, activations: Activations::Int16, ..Options::new(Method::Rtn, budget) };
    Ok(quantize(&policy.graph, None, rate, &options)?.1)
}

/// The largest error that activation rounding explains.
fn bound(outcomes: &[Outcome]) -> f64 {
    let part = outcomes.iter().map(|o| 1.0 / f64::from(o.x_max)).fold(0.0, f64::max);
    if part > 0.0 { PARTS * part } else { F32 }
}

/// Runs `work` with a head over the quantized policy.
fn on_head<T>(policy: &Policy, outcomes: &[Outcome], work: impl FnOnce(&mut Head<'_, '_>) -> Result<T>) -> Result<T> {
    let buffer = ImageBuffer::new(&emit::image(policy, outcomes)?);
    with_head(buffer.image(&policy.dir)?, work)
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
    ensure!(off < limit, "the f32 evaluator is off by {off:.2e}, {limit:.2e} are allowed");

    for group in [0, 32] {
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
        let limit = bound(&outcomes);
        ensure!(off < limit, "group {group}: the executor is off by {off:.2e}, {limit:.2e} are allowed");
    }
    Ok(())
}

/// The reference as [`deviation`] takes it.
fn follow(mut reference: Reference<'_>) -> impl FnMut(&[f64], bool) -> Vec<f64> {
    move |obs, reset| {
        if reset {
            reference.state.clear();
        }
        reference.step(obs)
    }
}

#[test]
fn functions() -> Result<()> {
    let ops = json!([
        {"op": "relu", "input": "obs", "save": "a"},
        {"op": "elu", "input": "obs", "save": "b"},
        {"op": "silu", "input": "obs", "save": "c"},
        {"op": "gelu", "input": "obs", "save": "d"},
        {"op": "gelu", "approximate": "none", "input": "obs", "save": "e"},
        {"op": "gelu", "approximate": "tanh", "input": "obs", "save": "f"},
        {"op": "tanh", "input": "obs", "save": "g"},
        {"op": "sigmoid", "input": "obs", "save": "h"},
        {"op": "identity", "input": ["a", "b", "c", "d", "e", "f", "g", "h"]},
    ]);
    check(11, 88, ops)
}

#[test]
fn normalize_with_either_clip_both_and_none() -> Result<()> {
    let ops = json!([
        {"op": "normalize", "mean": "m 7", "scale": "s 7", "input": "obs", "save": "a"},
        {"op": "normalize", "mean": "m 7", "scale": "s 7", "pre_clip": 1.5, "input": "obs", "save": "b"},
        {"op": "normalize", "mean": "m 7", "scale": "s 7", "clip": 0.7, "input": "obs", "save": "c"},
        {"op": "normalize", "mean": "n 7", "scale": "t 7", "pre_clip": 2.0, "clip": 1.0, "input": "obs", "save": "d"},
        {"op": "identity", "input": ["a", "b", "c", "d"]},
    ]);
    check(7, 28, ops)
}

#[test]
fn norms_with_given_and_default_eps() -> Result<()> {
    // Clipped to 0.003 the variance is about the default eps, so that a wrong default shows.
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

#[test]
fn slots_and_slices_behind_each_other() -> Result<()> {
    let ops = json!([
        {"op": "tanh", "input": "obs[3:10]", "save": "a"},
        {"op": "sigmoid", "input": ["a[:4]", "obs", "a[2:]", "a[:]"], "save": "b"},
        // A name given again stands for the later value.
        {"op": "relu", "input": "b[7:14]", "save": "a"},
        {"op": "identity", "input": ["b", "a[1:2]", "obs[11:]", "a"]},
    ]);
    check(12, 37, ops)
}

#[test]
fn add_of_a_slot_of_the_observation_and_of_itself() -> Result<()> {
    let ops = json!([
        {"op": "add", "with": "obs", "save": "twice"},
        {"op": "tanh", "save": "t"},
        {"op": "add", "with": "twice", "save": "s"},
        {"op": "add", "with": "s"},
        {"op": "add", "with": "t", "input": "s"},
        {"op": "add", "with": "obs"},
    ]);
    check(6, 6, ops)
}

#[test]
fn a_policy_without_weights_gives_its_observation() -> Result<()> {
    check(5, 5, json!([{"op": "identity"}]))
}

#[test]
fn linear_of_all_remainders() -> Result<()> {
    // One more and one less than quads, pairs, units and groups; one row, one column; with bias and without.
    let ops = json!([
        {"op": "linear", "w": "a 5x33", "b": "b 5", "input": "obs[:33]", "save": "a"},
        {"op": "linear", "w": "c 31x65", "input": "obs", "save": "b"},
        {"op": "linear", "w": "d 1x31", "b": "e 1", "save": "c"},
        {"op": "linear", "w": "f 6x1"},
        {"op": "identity", "input": ["a", "b", "c", "obs[:2]"], "save": "d"},
        {"op": "linear", "w": "g 40x39", "b": "h 40"},
    ]);
    check(65, 40, ops)
}

#[test]
fn a_matrix_that_two_operations_share() -> Result<()> {
    let ops = json!([
        {"op": "linear", "w": "w 12x12", "b": "a 12", "save": "x"},
        {"op": "elu"},
        {"op": "linear", "w": "w 12x12", "b": "b 12"},
        {"op": "add", "with": "x"},
    ]);
    check(12, 12, ops)
}

#[test]
fn values_in_use_survive_operations_in_place() -> Result<()> {
    let ops = json!([
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
    ]);
    check(8, 58, ops)
}

fn recurrent(op: &str, rows: usize, cols: usize, hidden: usize, name: &str) -> Value {
    json!({
        "op": op, "hidden": hidden, "save": name,
        "w_ih": format!("{name}.ih {rows}x{cols}"), "w_hh": format!("{name}.hh {rows}x{hidden}"),
        "b_ih": format!("{name}.bi {rows}"), "b_hh": format!("{name}.bh {rows}"),
    })
}

#[test]
fn two_lstms_in_series() -> Result<()> {
    let ops = json!([recurrent("lstm", 28, 9, 7, "first"), recurrent("lstm", 20, 7, 5, "second")]);
    check(9, 5, ops)
}

#[test]
fn gru_with_and_without_biases() -> Result<()> {
    let ops = json!([
        recurrent("gru", 18, 8, 6, "first"),
        {"op": "gru", "hidden": 5, "gates": "r,z,n", "w_ih": "w 15x6", "w_hh": "v 15x5"},
    ]);
    check(8, 5, ops)
}

#[test]
fn recurrent_outputs_may_be_overwritten_but_not_the_state() -> Result<()> {
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
        // Nothing else reads the state here, so that it is tempting to work in place.
        let plain = json!([recurrent(op, gates * 6, 7, 6, "h"), {"op": "tanh"}]);
        check(7, 6, plain).context(op)?;
    }
    Ok(())
}

const FUNCTIONS: [&str; 6] = ["relu", "elu", "silu", "gelu", "tanh", "sigmoid"];

/// Some operations on earlier values, with names that are given again.
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
            // A large eps: a norm over values that are nearly equal would magnify the rounding without end.
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
fn drawn_graphs() -> Result<()> {
    let mut random = Random::new(3);
    for _ in 0..400 {
        let ops = drawn_ops(&mut random, 9, 4);
        check(9, 4, ops.clone()).with_context(|| format!("{ops:#}"))?;
    }
    Ok(())
}

/// What the contract makes of raw output `y` (policy.json's `action`, or its default), and which limits it met.
fn contract(action: &Value, raw: &[f64], last: Option<&[f64]>, met: &mut [usize; 3]) -> Vec<f64> {
    // The format's constants are f32.
    let at = |name: &str, i: usize| action[name][i].as_f64().map(|v| f64::from(v as f32));
    let mut limit = |which: usize, value: f64, limited: f64| {
        met[which] += usize::from(value != limited);
        limited
    };
    raw.iter()
        .enumerate()
        .map(|(i, &y)| {
            let wide = |name: &str| action[name][i].as_f64();
            let y = match (wide("mean"), wide("std"), wide("q01"), wide("q99")) {
                (Some(mean), Some(std), _, _) => y * std + mean,
                // As RLDS and OpenVLA have it.
                (_, _, Some(q01), Some(q99)) => 0.5 * (y + 1.0) * (q99 - q01 + 1e-8) + q01,
                _ => y,
            };
            let a = y * at("scale", i).unwrap_or(1.0) + at("offset", i).unwrap_or(0.0);
            let a = limit(0, a, a.max(at("low", i).unwrap_or(f64::MIN)));
            let a = limit(1, a, a.min(at("high", i).unwrap_or(f64::MAX)));
            match (last, at("max_step", i)) {
                (Some(last), Some(step)) => limit(2, a, a.clamp(last[i] - step, last[i] + step)),
                _ => a,
            }
        })
        .collect()
}

/// Plays the policy through its contract, `execute` actions of each chunk, and gives how often low, high and max_step acted.
fn check_actions(mut json: Value, action: &Value) -> Result<[usize; 3]> {
    let act = 2;
    let chunk = json["chunk"].as_u64().unwrap_or(1) as usize;
    let execute = json["execute"].as_u64().map_or(chunk, |n| n as usize);
    let out = chunk * act;
    json["name"] = json!("test");
    json["obs_dim"] = json!(6);
    json["act_dim"] = json!(act);
    json["ops"] = json!([
        recurrent("lstm", 32, 6, 8, "h"),
        {"op": "linear", "w": format!("w {out}x8"), "b": format!("b {out}")},
    ]);
    let case = Case::new(json)?;
    let policy = Policy::load(case.dir.path())?;
    let outcomes = rtn(&policy, 0)?;
    let mut reference = case.dequantized(&policy, &outcomes);
    let mut met = [0; 3];
    let (mut plan, mut played, mut last) = (Vec::new(), 0, None::<Vec<f64>>);
    let expected = |obs: &[f64], reset: bool| {
        if reset {
            reference.state.clear();
            (played, last) = (0, None);
        }
        if played == 0 {
            plan = reference.step(obs);
        }
        let raw = &plan[played * act..][..act];
        let a = contract(action, raw, last.as_deref(), &mut met);
        played = (played + 1) % execute;
        last = Some(a.clone());
        a
    };
    let off = on_head(&policy, &outcomes, |head| {
        let run = |obs: &[f32], reset: bool| {
            if reset {
                head.reset();
            }
            Ok(wide(head.step(obs)?))
        };
        deviation(&case.observations(), run, expected)
    })?;
    let limit = bound(&outcomes);
    ensure!(off < limit, "actions are off by {off:.2e}, {limit:.2e} are allowed");
    Ok(met)
}

#[test]
fn chunks_go_through_the_whole_contract() -> Result<()> {
    let action = json!({
        "scale": [1.7, -0.6], "offset": [0.1, 0.2], "low": [-0.8, -0.3], "high": [0.9, 0.35], "max_step": [0.5, 0.2],
    });
    // 3 executed of 4; the reset (step 25) falls inside a chunk.
    let met = check_actions(json!({"kind": "chunk", "chunk": 4, "execute": 3, "action": action}), &action)?;
    ensure!(met.iter().all(|&n| n > 2), "limits that were not tried: {met:?}");
    Ok(())
}

#[test]
fn outputs_are_unnormalised_by_moments_or_quantiles() -> Result<()> {
    for action in [
        json!({"mean": [0.3, -0.2], "std": [0.5, 1.5]}),
        json!({"mean": [0.3, null], "std": [0.5, null], "scale": [2.0, -1.0], "offset": [0.1, 0.2]}),
        json!({"q01": [-0.4, 0.1], "q99": [0.9, 1.1], "low": [-0.3, 0.2], "high": [0.8, 1.0]}),
        json!({"q01": [null, 0.1], "q99": [null, 1.1], "scale": [0.5, 3.0]}),
    ] {
        check_actions(json!({"action": action}), &action).with_context(|| action.to_string())?;
    }
    Ok(())
}

#[test]
fn each_part_of_the_contract_may_stand_alone() -> Result<()> {
    for (name, values) in [
        ("scale", [0.5, -3.0]),
        ("offset", [1.0, -2.0]),
        ("low", [-0.1, 0.1]),
        ("high", [0.1, -0.1]),
        ("max_step", [0.1, 0.0]),
    ] {
        let action = json!({name: values});
        let met = check_actions(json!({"action": action}), &action).context(name)?;
        let limits = usize::from(!matches!(name, "scale" | "offset"));
        ensure!(met.iter().filter(|&&n| n > 2).count() == limits, "{name}: limits met {met:?}");
    }
    Ok(())
}

#[test]
fn without_a_contract_chunks_are_limited_to_one_and_steps_are_not() -> Result<()> {
    let one = json!({"low": [-1, -1], "high": [1, 1]});
    // Long chunks, so that enough of their values are beyond 1.
    let met = check_actions(json!({"kind": "chunk", "chunk": 20}), &one)?;
    ensure!(met[0] + met[1] > 2, "the limits were not tried: {met:?}");
    check_actions(json!({"kind": "step"}), &Value::Null)?;
    Ok(())
}
