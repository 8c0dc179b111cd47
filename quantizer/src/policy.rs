//! Reading a policy folder: `policy.json` (the op list) and `policy.safetensors` (the weights).

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};

use actq_kernels::image::Kind;
use actq_kernels::math::Function;
use anyhow::{Context, Result, bail, ensure};
use safetensors::{Dtype, SafeTensors};
use serde::Deserialize;
use serde_json::Value;
use sha2::{Digest, Sha256};

use crate::graph::ops::{Add, Concat, Gru, LayerNorm, Linear, Lstm, Normalize, Pointwise, RmsNorm, Span};
use crate::graph::{Graph, NodeKind, ValueId, WeightMatrix};

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
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
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

#[derive(Deserialize)]
struct Json {
    name: String,
    kind: Option<String>,
    chunk: Option<usize>,
    execute: Option<usize>,
    obs_dim: usize,
    act_dim: usize,
    control_hz: Option<f32>,
    action: Option<Contract>,
    ops: Vec<JsonOp>,
}

/// One op; [`JsonOp::keys`] says which keys it may have.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct JsonOp {
    op: String,
    input: Option<Input>,
    save: Option<String>,
    with: Option<String>,
    w: Option<String>,
    b: Option<String>,
    mean: Option<String>,
    scale: Option<String>,
    pre_clip: Option<f32>,
    clip: Option<f32>,
    w_ln: Option<String>,
    b_ln: Option<String>,
    eps: Option<f32>,
    hidden: Option<usize>,
    gates: Option<String>,
    w_ih: Option<String>,
    w_hh: Option<String>,
    b_ih: Option<String>,
    b_hh: Option<String>,
    approximate: Option<String>,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Input {
    One(String),
    Many(Vec<String>),
}

impl JsonOp {
    /// Refuses keys that an op does not have: one that is ignored would be another policy. Whatever else is wrong with `json` is
    /// left to the reader.
    fn check_keys(json: &Value) -> Result<()> {
        for (i, op) in json["ops"].as_array().into_iter().flatten().enumerate() {
            let (Some(op), Some(name)) = (op.as_object(), op["op"].as_str()) else { continue };
            let Some(own) = Self::keys(name) else { continue };
            let keys = [&["op", "input", "save"], own].concat();
            // A key without a value says nothing.
            let mut given = op.iter().filter(|(_, value)| !value.is_null()).map(|(key, _)| key);
            if let Some(key) = given.find(|key| !keys.contains(&key.as_str())) {
                bail!("op {i} ({name}) has the key {key:?}; its keys are {}", keys.join(", "));
            }
        }
        Ok(())
    }

    /// The keys of an op beside those of every op; `None` for an unknown op.
    fn keys(op: &str) -> Option<&'static [&'static str]> {
        Some(match op {
            "identity" => &[],
            "normalize" => &["mean", "scale", "pre_clip", "clip"],
            "linear" => &["w", "b"],
            "layernorm" => &["w_ln", "b_ln", "eps"],
            "rmsnorm" => &["w_ln", "eps"],
            "add" => &["with"],
            "lstm" | "gru" => &["hidden", "gates", "w_ih", "w_hh", "b_ih", "b_hh"],
            "gelu" => &["approximate"],
            name if Function::ALL.iter().any(|f| f.name() == name) => &[],
            _ => return None,
        })
    }
}

impl Policy {
    /// Reads `policy.json` and `policy.safetensors` from `dir`. Every error names the file and the op or tensor.
    pub fn load(dir: &Path) -> Result<Self> {
        ensure!(dir.is_dir(), "{}: not a folder; give the one that holds policy.json", dir.display());
        let json_path = dir.join("policy.json");
        let weights_path = dir.join("policy.safetensors");
        let json_bytes = fs::read(&json_path).with_context(|| format!("{}: cannot be read", json_path.display()))?;
        let weight_bytes =
            fs::read(&weights_path).with_context(|| format!("{}: cannot be read", weights_path.display()))?;
        let not_json = || format!("{}: not a policy description", json_path.display());
        let value: Value = serde_json::from_slice(&json_bytes).with_context(not_json)?;
        JsonOp::check_keys(&value).with_context(|| json_path.display().to_string())?;
        let json: Json = serde_json::from_slice(&json_bytes).with_context(not_json)?;
        let tensors = SafeTensors::deserialize(&weight_bytes)
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
        let (kind, chunk, execute) = match json.kind.as_deref().unwrap_or("step") {
            "step" => (Kind::Step, 1, 1),
            "chunk" => {
                let chunk = json.chunk.context("kind chunk needs the key chunk")?;
                let execute = json.execute.unwrap_or(chunk);
                ensure!((1..=chunk).contains(&execute), "execute is {execute}, it must be 1 to chunk ({chunk})");
                (Kind::Chunk, chunk, execute)
            }
            other => bail!("kind {other:?} is not supported yet; step and chunk are"),
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
        // Without an `action` object a chunk is limited to -1..1, as the reference runtime of the format does.
        let contract = json.action.clone().unwrap_or_else(|| match kind {
            Kind::Step => Contract::default(),
            Kind::Chunk => Contract {
                low: Some(vec![-1.0; json.act_dim]),
                high: Some(vec![1.0; json.act_dim]),
                ..Contract::default()
            },
        });
        for (name, array) in contract.arrays() {
            let Some(array) = array else { continue };
            ensure!(
                array.len() == json.act_dim,
                "action.{name} has {} values, act_dim is {}",
                array.len(),
                json.act_dim
            );
            ensure!(array.iter().all(|v| v.is_finite()), "action.{name} holds a value that is not finite");
        }
        if let (Some(low), Some(high)) = (&contract.low, &contract.high) {
            ensure!(low.iter().zip(high).all(|(l, h)| l <= h), "action.low exceeds action.high");
        }
        ensure!(contract.max_step.iter().flatten().all(|s| *s >= 0.0), "action.max_step holds a negative value");
        let rate_hz = json.control_hz.unwrap_or(50.0);
        ensure!(rate_hz.is_finite() && rate_hz > 0.0, "control_hz must be above 0");
        Ok(Self {
            dir: dir.to_owned(),
            name: json.name.clone(),
            kind,
            chunk,
            execute,
            act_len: json.act_dim,
            rate_hz,
            contract,
            weights: builder.graph.weights(),
            graph: std::mem::replace(&mut builder.graph, Graph::new(0)),
            digest,
        })
    }
}

struct Tensors<'a> {
    file: &'a SafeTensors<'a>,
    path: &'a Path,
}

impl Tensors<'_> {
    /// The tensor as f32 with its shape; refuses NaN and infinities.
    fn read(&self, name: &str) -> Result<(Vec<usize>, Vec<f32>)> {
        let file = self.path.display();
        let Ok(view) = self.file.tensor(name) else {
            let mut names = self.file.names();
            names.sort_unstable();
            bail!("{file}: tensor {name:?} is missing; the file holds {}", names.join(", "));
        };
        let bytes = view.data();
        let data: Vec<f32> = match view.dtype() {
            Dtype::F32 => bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect(),
            Dtype::F16 => bytes.chunks_exact(2).map(|b| half::f16::from_le_bytes([b[0], b[1]]).to_f32()).collect(),
            Dtype::BF16 => bytes.chunks_exact(2).map(|b| half::bf16::from_le_bytes([b[0], b[1]]).to_f32()).collect(),
            Dtype::F64 => bytes
                .chunks_exact(8)
                .map(|b| f64::from_le_bytes([b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7]]) as f32)
                .collect(),
            other => bail!("{file}: tensor {name:?} is of type {other:?}; export it as float32"),
        };
        if let Some(at) = data.iter().position(|v| !v.is_finite()) {
            bail!("{file}: tensor {name:?} holds {} at position {at}; retrain or repair the checkpoint", data[at]);
        }
        Ok((view.shape().to_vec(), data))
    }

    fn vector(&self, name: &str, len: usize) -> Result<Vec<f32>> {
        let (shape, data) = self.read(name)?;
        ensure!(
            data.len() == len,
            "{}: tensor {name:?} has the shape {shape:?}, {len} values are needed here",
            self.path.display()
        );
        Ok(data)
    }

    fn matrix(&self, name: &str, rows: Option<usize>, cols: usize) -> Result<WeightMatrix> {
        let (shape, data) = self.read(name)?;
        let fits = matches!(shape[..], [r, c] if r > 0 && c == cols && rows.is_none_or(|rows| r == rows));
        ensure!(
            fits,
            "{}: tensor {name:?} has the shape {shape:?}, [{}, {cols}] is needed here (rows are outputs)",
            self.path.display(),
            rows.map_or("out".to_owned(), |r| r.to_string()),
        );
        Ok(WeightMatrix { name: name.to_owned(), rows: shape[0], cols, data })
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
                eps: eps(op.eps, 1e-5)?,
            })),
            "rmsnorm" => Some(NodeKind::from(RmsNorm {
                weight: self.tensors.vector(need(&op.w_ln, "w_ln")?, len)?,
                eps: eps(op.eps, 1e-6)?,
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

fn clip(value: Option<f32>, name: &str) -> Result<f32> {
    let value = value.unwrap_or(f32::INFINITY);
    ensure!(value > 0.0, "{name} must be above 0");
    Ok(value)
}

fn eps(value: Option<f32>, default: f32) -> Result<f32> {
    let value = value.unwrap_or(default);
    ensure!(value > 0.0 && value.is_finite(), "eps must be above 0");
    Ok(value)
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
