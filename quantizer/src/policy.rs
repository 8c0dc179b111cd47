//! Reading a policy folder: `policy.json` (the op list) and `policy.safetensors` (the weights).

mod json;
mod tensors;

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};

use actq_kernels::image::Kind;
use actq_kernels::math::Function;
use anyhow::{Context, Result, bail, ensure};
use sha2::{Digest, Sha256};

use crate::dataset::recording::Recording;
use crate::graph::ops::{Add, Concat, Gru, LayerNorm, Linear, Lstm, Normalize, Pointwise, RmsNorm, Span};
use crate::graph::{Graph, NodeKind, ValueId};
use crate::tensor_file;
use json::{Input, Json, JsonOp, positive};
use tensors::Tensors;

const FILES: [&str; 2] = ["policy.json", "policy.safetensors"];

/// All files that a policy's folder may hold, whether they are there or not.
pub fn files(dir: &Path) -> Vec<PathBuf> {
    let own = FILES.map(|name| dir.join(name));
    own.into_iter().chain(Recording::Calib.paths(dir)).chain(Recording::Heldout.paths(dir)).collect()
}

/// A policy as it was trained.
#[derive(Clone, Debug)]
pub struct Policy {
    /// Where it was read from.
    pub dir: PathBuf,
    /// Its name.
    pub name: String,
    /// What its output means.
    pub kind: Kind,
    /// Actions in the network's output; 1 for [`Kind::Step`].
    pub chunk: usize,
    /// Actions executed of a chunk.
    pub execute: usize,
    /// Length of an action.
    pub act_len: usize,
    /// Control rate in Hz.
    pub rate_hz: f32,
    /// What stands between the output and the robot.
    pub contract: Contract,
    /// The network.
    pub graph: Graph,
    /// Weights of all its matrices as they were trained, which bits per weight refer to.
    pub weights: usize,
    /// SHA-256 of policy.json, then policy.safetensors.
    pub digest: [u8; 32],
}

/// The action contract; each array has one value per action dimension, or is absent. In the order in which they apply.
#[derive(Clone, Debug, Default)]
pub struct Contract {
    /// Factors.
    pub scale: Option<Vec<f32>>,
    /// Offsets.
    pub offset: Option<Vec<f32>>,
    /// Lower limits.
    pub low: Option<Vec<f32>>,
    /// Upper limits.
    pub high: Option<Vec<f32>>,
    /// Largest change from one action to the next.
    pub max_step: Option<Vec<f32>>,
}

impl Contract {
    /// The arrays with their names, in the order of the image's flags.
    pub fn arrays(&self) -> [(&'static str, &Option<Vec<f32>>); 5] {
        [
            ("scale", &self.scale),
            ("offset", &self.offset),
            ("low", &self.low),
            ("high", &self.high),
            ("max_step", &self.max_step),
        ]
    }
}

impl Policy {
    /// Reads `policy.json` and `policy.safetensors` from `dir`. Every error names the file and the op or tensor.
    pub fn load(dir: &Path) -> Result<Self> {
        ensure!(dir.is_dir(), "{}: not a folder; give the one that holds policy.json", dir.display());
        let [json_path, weights_path] = FILES.map(|name| dir.join(name));
        let json_bytes = fs::read(&json_path).with_context(|| format!("{}: cannot be read", json_path.display()))?;
        let weight_bytes =
            fs::read(&weights_path).with_context(|| format!("{}: cannot be read", weights_path.display()))?;
        let json = Json::parse(&json_bytes).with_context(|| json_path.display().to_string())?;
        let tensors = tensor_file::open(&weight_bytes)
            .with_context(|| format!("{}: not a safetensors file", weights_path.display()))?;
        let mut digest = Sha256::new();
        digest.update(&json_bytes);
        digest.update(&weight_bytes);
        let mut builder = Builder {
            tensors: Tensors { file: &tensors, path: &weights_path },
            graph: Graph::new(json.obs_dim),
            slots: HashMap::from([("obs".to_owned(), 0)]),
        };
        Self::build(dir, &json, &mut builder, digest.finalize().into()).with_context(|| json_path.display().to_string())
    }

    fn build(dir: &Path, json: &Json, builder: &mut Builder<'_>, digest: [u8; 32]) -> Result<Self> {
        ensure!(json.obs_dim > 0 && json.act_dim > 0, "obs_dim and act_dim must be at least 1");
        for (name, n) in [("obs_dim", json.obs_dim), ("act_dim", json.act_dim), ("chunk", json.chunk.unwrap_or(1))] {
            ensure!(n <= usize::from(u16::MAX), "{name} is {n}, 65535 is the most");
        }
        ensure!(!json.ops.is_empty(), "ops is empty");
        ensure!(json.name.len() <= 200, "name is longer than 200 bytes");
        let kind = json.kind()?;
        let (chunk, execute) = match kind {
            Kind::Step => (1, 1),
            Kind::Chunk => {
                let chunk = json.chunk.context("kind chunk needs the key chunk")?;
                let execute = json.execute.unwrap_or(chunk);
                ensure!((1..=chunk).contains(&execute), "execute is {execute}, it must be 1 to chunk ({chunk})");
                (chunk, execute)
            }
        };
        for (i, op) in json.ops.iter().enumerate() {
            builder.add(op).with_context(|| format!("op {i} ({})", op.op))?;
        }
        let out_len = builder.graph.len_of(builder.graph.output());
        ensure!(
            out_len == chunk * json.act_dim,
            "the last op gives {out_len} values, chunk * act_dim is {}",
            chunk * json.act_dim
        );
        Ok(Self {
            dir: dir.to_owned(),
            name: json.name.clone(),
            kind,
            chunk,
            execute,
            act_len: json.act_dim,
            rate_hz: positive(json.control_hz.unwrap_or(50.0), "control_hz")?,
            contract: json.contract(kind)?,
            weights: builder.graph.weights(),
            graph: std::mem::replace(&mut builder.graph, Graph::new(0)),
            digest,
        })
    }
}

struct Builder<'a> {
    tensors: Tensors<'a>,
    graph: Graph,
    slots: HashMap<String, ValueId>,
}

impl Builder<'_> {
    fn add(&mut self, op: &JsonOp) -> Result<()> {
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
                mean: self.tensors.vector(need(&op.mean, "mean")?, len)?,
                scale: self.tensors.vector(need(&op.scale, "scale")?, len)?,
                pre_clip: clip(op.pre_clip, "pre_clip")?,
                clip: clip(op.clip, "clip")?,
            })),
            "linear" => {
                let matrix = self.matrix(need(&op.w, "w")?, None, len)?;
                let rows = self.graph.matrices[matrix].rows;
                Some(Linear { matrix, bias: self.bias(&op.b, rows)? }.into())
            }
            "layernorm" => Some(NodeKind::from(LayerNorm {
                weight: self.tensors.vector(need(&op.w_ln, "w_ln")?, len)?,
                bias: self.bias(&op.b_ln, len)?,
                eps: positive(op.eps.unwrap_or(1e-5), "eps")?,
            })),
            "rmsnorm" => Some(NodeKind::from(RmsNorm {
                weight: self.tensors.vector(need(&op.w_ln, "w_ln")?, len)?,
                eps: positive(op.eps.unwrap_or(1e-6), "eps")?,
            })),
            "add" => {
                inputs.push(self.slot(need(&op.with, "with")?)?);
                Some(Add.into())
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
        let hidden = op.hidden.context("needs the key hidden")?;
        ensure!((1..=usize::from(u16::MAX)).contains(&hidden), "hidden is {hidden}, it must be 1 to 65535");
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
            // Both biases only ever occur as their sum.
            let bias = input_bias.iter().zip(&state_bias).map(|(a, b)| a + b).collect();
            Lstm { hidden, input, state, bias }.into()
        } else {
            Gru { hidden, input, state, input_bias, state_bias }.into()
        })
    }

    fn bias(&self, name: &Option<String>, len: usize) -> Result<Vec<f32>> {
        name.as_ref().map_or_else(|| Ok(vec![0.0; len]), |name| self.tensors.vector(name, len))
    }

    /// The matrix of a tensor; one that several ops share is read once.
    fn matrix(&mut self, name: &str, rows: Option<usize>, cols: usize) -> Result<usize> {
        let matrix = self.tensors.matrix(name, rows, cols)?;
        self.graph.matrix_named(name).map_or_else(|| self.graph.add_matrix(matrix), Ok)
    }

    fn slot(&self, name: &str) -> Result<ValueId> {
        self.slots.get(name).copied().with_context(|| {
            let mut known: Vec<_> = self.slots.keys().map(String::as_str).collect();
            known.sort_unstable();
            format!("slot {name:?} has not been saved before; known are {}", known.join(", "))
        })
    }

    /// The value of one slot, or of several slots and slices (`name[a:b]`) behind each other.
    fn gather(&mut self, names: &[String]) -> Result<ValueId> {
        let parts = names.iter().map(|name| self.part(name)).collect::<Result<Vec<_>>>()?;
        ensure!(!parts.is_empty(), "input is an empty list");
        if let [(value, span)] = parts[..]
            && span.len == self.graph.len_of(value)
        {
            return Ok(value);
        }
        let (values, spans): (Vec<_>, Vec<_>) = parts.into_iter().unzip();
        self.graph.add(Concat(spans), &values)
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
                parsed.with_context(|| format!("input {text:?} is not name[from:to]"))?
            }
        };
        ensure!(from < to && to <= whole, "input {text:?} reaches beyond the slot's {whole} values");
        Ok((value, Span { from, len: to - from }))
    }
}

fn need<'a>(key: &'a Option<String>, name: &str) -> Result<&'a str> {
    key.as_deref().with_context(|| format!("needs the key {name}"))
}

fn clip(value: Option<f64>, name: &str) -> Result<f32> {
    value.map_or(Ok(f32::INFINITY), |value| positive(value, name))
}

fn function(name: &str, approximate: Option<&str>) -> Result<Function> {
    let name = match (name, approximate) {
        ("gelu", Some("tanh")) => "gelu_tanh",
        (name, None | Some("none")) => name,
        (_, Some(other)) => bail!("approximate {other:?} is not known; none and tanh are"),
    };
    Function::ALL.into_iter().find(|f| f.name() == name).with_context(|| {
        format!(
            "unknown op; known are normalize, linear, layernorm, rmsnorm, add, lstm, gru, identity, {}",
            Function::ALL.map(Function::name).join(", ")
        )
    })
}
