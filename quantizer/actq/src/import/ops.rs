//! Builds a network from the op list of `policy.json` over named slots and the weights of `policy.safetensors`.

use std::collections::HashMap;
use std::path::Path;

use actq_kernels::math::Function;

use super::denoising::{JsonDenoising, JsonNorm, JsonTime, Schedule};
use super::json::{Input, JsonOp};
use super::numbers::positive;
use super::tensors::TensorFile;
use crate::error::{Context, Result, bail, ensure};
use crate::graph::ops::{Add, Concat, Gru, LayerNorm, Linear, Lstm, Mul, Normalize, Pointwise, RmsNorm, Span};
use crate::graph::{Graph, NodeKind, ValueId, WeightMatrix};

/// The weights, and their file's name for errors.
pub(super) struct Weights<'a> {
    pub(super) file: TensorFile<'a>,
    pub(super) path: &'a Path,
}

impl Weights<'_> {
    /// Reads a tensor as f32 with its shape; refuses NaN, infinities and values beyond f32.
    fn read(&self, name: &str) -> Result<(Vec<usize>, Vec<f32>)> {
        let file = self.path.display();
        let Some(tensor) = self.file.get(name) else {
            bail!("{file}: tensor {name:?} is missing; the file holds {}", self.file.names().join(", "));
        };
        let Some(data) = tensor.values.to_f32() else {
            bail!("{file}: tensor {name:?} is of type {}; export it as float32", tensor.values.type_name());
        };
        if let Some(at) = data.iter().position(|v| !v.is_finite()) {
            let wrong = tensor.values.not_f32(at);
            bail!("{file}: tensor {name:?} {wrong} at position {at}; retrain or repair the checkpoint");
        }
        Ok((tensor.shape, data))
    }

    fn vector(&self, name: &str, len: usize) -> Result<Vec<f32>> {
        let (shape, data) = self.read(name)?;
        ensure!(
            data.len() == len,
            "{}: tensor {name:?} has the shape {shape:?}, but {len} values are needed here",
            self.path.display()
        );
        Ok(data)
    }

    fn matrix(&self, name: &str, rows: Option<usize>, cols: usize) -> Result<WeightMatrix> {
        let (shape, data) = self.read(name)?;
        let fits = matches!(shape[..], [r, c] if r > 0 && c == cols && rows.is_none_or(|rows| r == rows));
        ensure!(
            fits,
            "{}: tensor {name:?} has the shape {shape:?}, but [{}, {cols}] is needed here (rows are outputs)",
            self.path.display(),
            rows.map_or("out".to_owned(), |r| r.to_string()),
        );
        Ok(WeightMatrix { name: name.to_owned(), rows: shape[0], cols, data })
    }
}

/// A network under construction.
pub(super) struct Builder<'a> {
    weights: Weights<'a>,
    /// Network so far.
    pub(super) graph: Graph,
    slots: HashMap<String, ValueId>,
}

impl<'a> Builder<'a> {
    /// Begins with the observation alone.
    pub(super) fn new(obs_len: usize, weights: Weights<'a>) -> Self {
        Self { weights, graph: Graph::new(obs_len), slots: HashMap::from([("obs".to_owned(), 0)]) }
    }

    /// Begins the network of a flow or a diffusion policy over observation, time and iterate (slots `obs`, `tfeat` and
    /// `x`); returns it with its time input in each step.
    pub(super) fn iterative(
        obs_len: usize,
        by: &JsonDenoising,
        schedule: &Schedule,
        weights: Weights<'a>,
    ) -> Result<(Self, Vec<Vec<f32>>)> {
        let time = by.time.as_ref();
        let default = JsonTime::default();
        let time = time.unwrap_or(&default);
        let (_, freq) = weights.read(time.freq())?;
        let times = schedule.times.iter().map(|t| time.features(*t, &freq)).collect::<Result<Vec<_>>>()?;
        let lens = [obs_len, 2 * freq.len(), schedule.denoising.len];
        let mut graph = Graph::new(lens.iter().sum());
        let mut slots = HashMap::new();
        let mut from = 0;
        for (name, len) in ["obs", "tfeat", "x"].into_iter().zip(lens) {
            slots.insert(name.to_owned(), graph.add(Concat(vec![Span { from, len }]), &[0])?);
            from += len;
        }
        // The format's first exporter names the tensors, but writes no key.
        let file = JsonNorm { mean: "obs_norm.mean".to_owned(), scale: "obs_norm.scale".to_owned(), clip: Some(5.0) };
        let implied = weights.file.get(&file.mean).is_some().then_some(&file);
        if let Some(norm) = by.obs_norm.as_ref().or(implied) {
            let normalize = Normalize {
                mean: weights.vector(&norm.mean, obs_len)?,
                scale: weights.vector(&norm.scale, obs_len)?,
                pre_clip: f32::INFINITY,
                clip: clip(norm.clip, "obs_norm.clip")?,
            };
            let normal = graph.add(normalize, &[slots["obs"]])?;
            slots.insert("obs".to_owned(), normal);
        }
        // The network's input has the same limit as the step's iterate (`Schedule`).
        if by.clip_iterate.is_some() {
            let len = schedule.denoising.len;
            let limited = Normalize {
                mean: vec![0.0; len],
                scale: vec![1.0; len],
                pre_clip: f32::INFINITY,
                clip: schedule.denoising.limit,
            };
            let limited = graph.add(limited, &[slots["x"]])?;
            slots.insert("x".to_owned(), limited);
        }
        Ok((Self { weights, graph, slots }, times))
    }

    /// Appends an op.
    pub(super) fn add(&mut self, op: &JsonOp) -> Result<()> {
        let input = match &op.input {
            None => self.graph.output(),
            Some(Input::One(name)) => self.gather(std::slice::from_ref(name))?,
            Some(Input::Many(names)) => self.gather(names)?,
        };
        let len = self.graph.len_of(input);
        let mut inputs = vec![input];
        let kind: Option<NodeKind> = match op.op.as_str() {
            "identity" => None,
            "normalize" => Some(NodeKind::from(Normalize {
                mean: self.weights.vector(need(&op.mean, "mean")?, len)?,
                scale: self.weights.vector(need(&op.scale, "scale")?, len)?,
                pre_clip: clip(op.pre_clip, "pre_clip")?,
                clip: clip(op.clip, "clip")?,
            })),
            "linear" => {
                let matrix = self.matrix(need(&op.w, "w")?, None, len)?;
                let rows = self.graph.matrices[matrix].rows;
                Some(Linear { matrix, bias: self.bias(&op.b, rows)? }.into())
            }
            "layernorm" => Some(NodeKind::from(LayerNorm {
                weight: self.weights.vector(need(&op.w_ln, "w_ln")?, len)?,
                bias: self.bias(&op.b_ln, len)?,
                eps: positive(op.eps.unwrap_or(1e-5), "eps")?,
            })),
            "rmsnorm" => Some(NodeKind::from(RmsNorm {
                weight: self.weights.vector(need(&op.w_ln, "w_ln")?, len)?,
                eps: positive(op.eps.unwrap_or(1e-6), "eps")?,
            })),
            "add" | "mul" => {
                inputs.push(self.slot(need(&op.with, "with")?)?);
                Some(if op.op == "add" { Add.into() } else { Mul.into() })
            }
            "lstm" | "gru" => Some(self.recurrent(op, len)?),
            name => Some(Pointwise(function(name, op.approximate.as_deref())?).into()),
        };
        if let Some(kind) = kind {
            self.graph.add(kind, &inputs)?;
        } else if input != self.graph.output() {
            bail!("identity cannot take another input; name the slot in the op that uses it");
        }
        if let Some(name) = &op.save {
            self.slots.insert(name.clone(), self.graph.output());
        }
        Ok(())
    }

    fn recurrent(&mut self, op: &JsonOp, len: usize) -> Result<NodeKind> {
        let hidden = op.hidden.context("the key \"hidden\" is missing")?;
        ensure!((1..=usize::from(u16::MAX)).contains(&hidden), "hidden is {hidden}; it must be 1 to 65535");
        let (gates, order) = if op.op == "lstm" { (4, "i,f,g,o") } else { (3, "r,z,n") };
        if let Some(gates) = &op.gates {
            ensure!(gates == order, "gates are {gates:?}; only torch's order {order:?} is supported");
        }
        let rows = gates * hidden;
        let input = self.matrix(need(&op.w_ih, "w_ih")?, Some(rows), len)?;
        let state = self.matrix(need(&op.w_hh, "w_hh")?, Some(rows), hidden)?;
        let input_bias = self.bias(&op.b_ih, rows)?;
        let state_bias = self.bias(&op.b_hh, rows)?;
        Ok(if op.op == "lstm" {
            // Only the sum of both biases is used.
            let bias = input_bias.iter().zip(&state_bias).map(|(a, b)| a + b).collect();
            Lstm { hidden, input, state, bias }.into()
        } else {
            Gru { hidden, input, state, input_bias, state_bias }.into()
        })
    }

    fn bias(&self, name: &Option<String>, len: usize) -> Result<Vec<f32>> {
        name.as_ref().map_or_else(|| Ok(vec![0.0; len]), |name| self.weights.vector(name, len))
    }

    /// Returns the matrix of a tensor; one that several ops share is read one time.
    fn matrix(&mut self, name: &str, rows: Option<usize>, cols: usize) -> Result<usize> {
        let matrix = self.weights.matrix(name, rows, cols)?;
        self.graph.share_matrix(matrix)
    }

    fn slot(&self, name: &str) -> Result<ValueId> {
        self.slots.get(name).copied().with_context(|| {
            let mut known: Vec<_> = self.slots.keys().map(String::as_str).collect();
            known.sort_unstable();
            format!("slot {name:?} has not been saved before; the slots are {}", known.join(", "))
        })
    }

    /// Returns the value of one slot, or the concatenation of several slots and slices (`name[a:b]`).
    fn gather(&mut self, names: &[String]) -> Result<ValueId> {
        let parts = names.iter().map(|name| self.part(name)).collect::<Result<Vec<_>>>()?;
        ensure!(!parts.is_empty(), "input is an empty list; name at least one slot");
        self.graph.join(parts)
    }

    fn part(&self, text: &str) -> Result<(ValueId, Span)> {
        let (name, range) = match text.split_once('[') {
            None => (text, None),
            Some((name, range)) => (name, Some(range)),
        };
        let value = self.slot(name)?;
        let whole = self.graph.len_of(value);
        let (from, to) = match range {
            None => (0, whole),
            Some(range) => {
                let parsed = range.strip_suffix(']').and_then(|r| r.split_once(':')).and_then(|(a, b)| {
                    let bound = |s: &str, default| if s.is_empty() { Some(default) } else { s.parse().ok() };
                    Some((bound(a, 0)?, bound(b, whole)?))
                });
                parsed.with_context(|| format!("input {text:?} is not of the form name[from:to]"))?
            }
        };
        ensure!(from < to && to <= whole, "input {text:?} exceeds the slot's {whole} values");
        Ok((value, Span { from, len: to - from }))
    }
}

fn need<'a>(key: &'a Option<String>, name: &str) -> Result<&'a str> {
    key.as_deref().with_context(|| format!("the key {name:?} is missing"))
}

fn clip(value: Option<f64>, name: &str) -> Result<f32> {
    value.map_or(Ok(f32::INFINITY), |value| positive(value, name))
}

fn function(name: &str, approximate: Option<&str>) -> Result<Function> {
    let name = match (name, approximate) {
        ("gelu", Some("tanh")) => "gelu_tanh",
        (name, None | Some("none")) => name,
        (_, Some(other)) => bail!("approximate {other:?} is not known; use none or tanh"),
    };
    Function::ALL.into_iter().find(|f| f.name() == name).with_context(|| {
        format!(
            "unknown op; the ops are normalize, linear, layernorm, rmsnorm, add, mul, lstm, gru, identity, {}",
            Function::ALL.map(Function::name).join(", ")
        )
    })
}
