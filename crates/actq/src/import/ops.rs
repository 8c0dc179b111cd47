//! Builds a network from the op list of `policy.json` over named slots and the weights of `policy.safetensors`.

use std::collections::{BTreeMap, HashMap};
use std::path::Path;

use serde_json::Value;

use super::denoising::{JsonDenoising, JsonNorm, JsonTime, Schedule};
use super::json::{IDENTITY, Input, JsonOp};
use super::values::Tensor;
use crate::error::{Context, Result, bail, ensure};
use crate::graph::ops::{Concat, Normalize, Span};
use crate::graph::syntax::{Keys, required};
use crate::graph::{Graph, NodeKind, ValueId, WeightMatrix};
use crate::numbers::limit;

/// The weights, and their file's name for errors.
#[derive(Clone, Copy)]
pub(super) struct Weights<'a> {
    pub(super) tensors: &'a BTreeMap<String, Tensor>,
    pub(super) path: &'a Path,
}

impl Weights<'_> {
    /// Reads a tensor as f32 with its shape; refuses NaN, infinities and values beyond f32.
    fn read(&self, name: &str) -> Result<(Vec<usize>, Vec<f32>)> {
        let file = self.path.display();
        let Some(tensor) = self.tensors.get(name) else {
            let names: Vec<&str> = self.tensors.keys().map(String::as_str).collect();
            bail!("{file}: tensor {name:?} is missing; the file holds {}", names.join(", "));
        };
        let Some(data) = tensor.values.to_f32() else {
            bail!("{file}: tensor {name:?} is of type {}; export it as float32", tensor.values.type_name());
        };
        if let Some(at) = data.iter().position(|v| !v.is_finite()) {
            let wrong = tensor.values.not_f32(at);
            bail!("{file}: tensor {name:?} {wrong} at position {at}; retrain or repair the checkpoint");
        }
        Ok((tensor.shape.clone(), data))
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
    /// The next value of the prefix, which follows the observation.
    prefix_at: usize,
}

impl<'a> Builder<'a> {
    /// Begins with the observation alone, and with a prefix of `prefix_len` values for attentions.
    pub(super) fn new(obs_len: usize, prefix_len: usize, weights: Weights<'a>) -> Result<Self> {
        let mut graph = Graph { prefix_len, ..Graph::new(obs_len + prefix_len) };
        let obs = if prefix_len > 0 { graph.add(Concat(vec![Span { from: 0, len: obs_len }]), &[0])? } else { 0 };
        Ok(Self { weights, graph, slots: HashMap::from([("obs".to_owned(), obs)]), prefix_at: obs_len })
    }

    /// Begins the network of a flow or a diffusion policy over observation, time and iterate (slots `obs`, `tfeat` and
    /// `x`). Returns it with its time input in each step.
    pub(super) fn iterative(
        [obs_len, prefix_len]: [usize; 2],
        by: &JsonDenoising,
        schedule: &Schedule,
        weights: Weights<'a>,
    ) -> Result<(Self, Vec<Vec<f32>>)> {
        let time = by.time.as_ref();
        let default = JsonTime::default();
        let time = time.unwrap_or(&default);
        let freq = if time.is_plain() { Vec::new() } else { weights.read(time.freq())?.1 };
        let times = schedule.times.iter().map(|t| time.features(*t, &freq)).collect::<Result<Vec<_>>>()?;
        let lens = [obs_len, times.first().map_or(0, Vec::len), schedule.denoising.len];
        let mut graph = Graph { prefix_len, ..Graph::new(prefix_len + lens.iter().sum::<usize>()) };
        let mut slots = HashMap::new();
        let mut from = 0;
        for (name, len) in ["obs", "tfeat", "x"].into_iter().zip(lens) {
            slots.insert(name.to_owned(), graph.add(Concat(vec![Span { from, len }]), &[0])?);
            // The prefix follows the observation.
            from += len + if from == 0 { prefix_len } else { 0 };
        }
        // The format's first exporter names the tensors, but writes no key.
        let file = JsonNorm { mean: "obs_norm.mean".to_owned(), scale: "obs_norm.scale".to_owned(), clip: Some(5.0) };
        let implied = weights.tensors.contains_key(&file.mean).then_some(&file);
        if let Some(norm) = by.obs_norm.as_ref().or(implied) {
            let normalize = Normalize {
                mean: weights.vector(&norm.mean, obs_len)?,
                scale: weights.vector(&norm.scale, obs_len)?,
                pre_clip: f32::INFINITY,
                clip: limit(norm.clip, "obs_norm.clip")?,
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
        Ok((Self { weights, graph, slots, prefix_at: obs_len }, times))
    }

    /// Appends an op.
    pub(super) fn add(&mut self, op: &JsonOp) -> Result<()> {
        let input = match &op.input {
            None => self.graph.output(),
            Some(Input::One(name)) => self.gather(std::slice::from_ref(name))?,
            Some(Input::Many(names)) => self.gather(names)?,
        };
        let mut keys = OpKeys { op, len: self.graph.len_of(input), inputs: vec![input], builder: self };
        let kind = NodeKind::read(&mut keys)?;
        let inputs = keys.inputs;
        if let Some(kind) = kind {
            self.graph.add(kind, &inputs)?;
        } else if op.op != IDENTITY {
            let names: Vec<_> = NodeKind::syntax().iter().map(|(name, _)| *name).collect();
            bail!("unknown op; the ops are {IDENTITY}, {}", names.join(", "));
        } else if input != self.graph.output() {
            bail!("identity cannot take another input; name the slot in the op that uses it");
        }
        if let Some(name) = &op.save {
            self.slots.insert(name.clone(), self.graph.output());
        }
        Ok(())
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

/// An op over values of the network.
struct OpKeys<'k, 'a> {
    op: &'k JsonOp,
    /// Length of the first input.
    len: usize,
    inputs: Vec<ValueId>,
    builder: &'k mut Builder<'a>,
}

impl Keys for OpKeys<'_, '_> {
    fn op(&self) -> &str {
        &self.op.op
    }

    fn input_len(&self) -> usize {
        self.len
    }

    fn text(&self, key: &str) -> Result<Option<&str>> {
        self.value(key, "a text", Value::as_str)
    }

    fn number(&self, key: &str) -> Result<Option<f64>> {
        self.value(key, "a number", Value::as_f64)
    }

    fn count(&self, key: &str) -> Result<Option<usize>> {
        self.value(key, "a whole number that is not negative", |value| value.as_u64()?.try_into().ok())
    }

    fn truth(&self, key: &str) -> Result<Option<bool>> {
        self.value(key, "true or false", Value::as_bool)
    }

    fn vector(&self, key: &str, len: usize) -> Result<Option<Vec<f32>>> {
        self.text(key)?.map(|name| self.builder.weights.vector(name, len)).transpose()
    }

    /// Reads a matrix that several ops share once.
    fn matrix(&mut self, key: &str, rows: Option<usize>, cols: usize) -> Result<(usize, usize)> {
        let matrix = self.builder.weights.matrix(required(self.text(key)?, key)?, rows, cols)?;
        let rows = matrix.rows;
        Ok((self.builder.graph.share_matrix(matrix)?, rows))
    }

    fn add_input(&mut self, key: &str) -> Result<()> {
        let value = self.builder.slot(required(self.text(key)?, key)?)?;
        self.inputs.push(value);
        Ok(())
    }

    fn add_prefix(&mut self, len: usize) -> Result<()> {
        let part = Concat(vec![Span { from: self.builder.prefix_at, len }]);
        self.inputs.push(self.builder.graph.add(part, &[0])?);
        self.builder.prefix_at += len;
        Ok(())
    }
}

impl OpKeys<'_, '_> {
    fn value<'v, T>(&'v self, key: &str, what: &str, of: impl Fn(&'v Value) -> Option<T>) -> Result<Option<T>> {
        let value = |value| of(value).with_context(|| format!("{key} is {value}; it must be {what}"));
        self.op.get(key).map(value).transpose()
    }
}
