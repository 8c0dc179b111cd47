//! An f64 interpreter of policy.json: the reference of executor and evaluator, which shares no code with them.

use std::collections::BTreeMap;

use actq::methods::Outcome;
use actq::policy::Policy;
use actq_bench::golden::Random;
use anyhow::{Context, Result};
use serde_json::Value;
use tempfile::TempDir;

use crate::folder::write_policy;

/// Steps of a run.
const STEPS: usize = 40;

/// Range of the observations in both directions: beyond every clip, into the tails of every function.
const REACH: f32 = 4.0;

type Tensors = BTreeMap<String, (Vec<usize>, Vec<f32>)>;

/// A policy on disk and in its parts.
pub(crate) struct Case {
    pub(crate) dir: TempDir,
    json: Value,
    tensors: Tensors,
}

impl Case {
    /// Writes the policy with random tensors: matrices that keep the variance of their input, vectors within -1 to 1.
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
        let dir = TempDir::new()?;
        let owned = tensors.iter().map(|(name, (shape, values))| (name, shape.clone(), values.clone()));
        write_policy(dir.path(), &json, owned)?;
        Ok(Self { dir, json, tensors })
    }

    pub(crate) fn reference(&self) -> Reference<'_> {
        let values = |(name, (_, v)): (&'_ String, &(Vec<usize>, Vec<f32>))| (name.clone(), wide(v));
        Reference { ops: ops(&self.json), tensors: self.tensors.iter().map(values).collect(), state: BTreeMap::new() }
    }

    /// Returns the reference with the weights that the codes represent.
    pub(super) fn dequantized(&self, policy: &Policy, outcomes: &[Outcome]) -> Reference<'_> {
        let mut reference = self.reference();
        for (matrix, outcome) in policy.graph.matrices.iter().zip(outcomes) {
            reference.tensors.insert(matrix.name.clone(), wide(&outcome.quantized.dequantized()));
        }
        reference
    }

    /// `false` if the policy has lost what the network ignores: its matrices are not those of the case then.
    pub(super) fn has_all_of(&self, policy: &Policy) -> bool {
        let tensors = self.reference().tensors;
        policy.graph.matrices.iter().all(|m| tensors.get(&m.name).is_some_and(|tensor| tensor.len() == m.data.len()))
    }

    pub(super) fn observations(&self) -> Vec<Vec<f32>> {
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

/// An interpreted policy.json.
pub(crate) struct Reference<'a> {
    ops: &'a [Value],
    pub(crate) tensors: BTreeMap<String, Vec<f64>>,
    /// Hidden and cell state by the op's position.
    pub(super) state: BTreeMap<usize, [Vec<f64>; 2]>,
}

impl Reference<'_> {
    pub(super) fn step(&mut self, obs: &[f64]) -> Vec<f64> {
        self.run(BTreeMap::from([("obs", obs.to_vec())]))
    }

    /// Runs the ops over these slots; the first op uses the slot `obs` unless it names one.
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
                "attention" => {
                    let [keys, values] = ["keys", "values"].map(|key| &slots[op[key].as_str().unwrap_or("")]);
                    let context = number("context", 0.0) as usize;
                    let before = if context > 0 { [h.clone(), c.clone()] } else { Default::default() };
                    let [keys, values] = [[&before[0], &keys[..]].concat(), [&before[1], &values[..]].concat()];
                    let heads = number("heads", 1.0);
                    let sizes = [heads, number("kv_heads", heads), number("dim", 1.0)].map(|size| size as usize);
                    let width = sizes[1] * sizes[2];
                    let first = if context > 0 { keys.len().saturating_sub(context * width) } else { 0 };
                    let factor = number("factor", number("dim", 1.0).powf(-0.5));
                    let y = attention(&x, [&keys[first..], &values[first..]], sizes, factor, op["causal"] == true);
                    if context > 0 {
                        (*h, *c) = (keys[first..].to_vec(), values[first..].to_vec());
                    }
                    y
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

/// Returns the values of `name` or `name[from:to]`.
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

/// Computes each head of each query, `[token, head, element]`.
fn attention(
    queries: &[f64],
    [keys, values]: [&[f64]; 2],
    [heads, shared, dim]: [usize; 3],
    factor: f64,
    causal: bool,
) -> Vec<f64> {
    let (count, all) = (queries.len() / (heads * dim), keys.len() / (shared * dim));
    let mut output = Vec::new();
    for (place, query) in queries.chunks_exact(dim).enumerate() {
        let (token, head) = (place / heads, place % heads / (heads / shared));
        let seen = if causal { all - (count - 1 - token) } else { all };
        let of = |x: &'_ [f64], i: usize| x[(i * shared + head) * dim..][..dim].to_vec();
        let powers: Vec<f64> = (0..seen)
            .map(|i| (factor * of(keys, i).iter().zip(query).map(|(k, q)| k * q).sum::<f64>()).exp())
            .collect();
        let total: f64 = powers.iter().sum();
        output.extend((0..dim).map(|e| (0..seen).map(|i| powers[i] / total * of(values, i)[e]).sum::<f64>()));
    }
    output
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
