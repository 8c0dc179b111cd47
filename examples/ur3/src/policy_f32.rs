//! Plain `f32` runner of an exported policy: the baseline for quantized policies.

use std::collections::{HashMap, VecDeque};
use std::f64::consts::TAU;
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use safetensors::{Dtype, SafeTensors};
use serde_json::Value;

use crate::random::Random;
use crate::{ACT_DIM, OBS_DIM};

/// Limit of a flow's normalised observation: the default of policy.json.
const OBS_CLIP: f32 = 5.0;
/// Seed of a flow's noise after each reset.
const NOISE_SEED: u64 = 1;

/// A chunk policy: the network proposes a chunk of actions, and the first `execute` of them are played before the next
/// evaluation. The chunk is the network's output; for a flow it is noise that has followed the network's velocities.
#[derive(Debug)]
pub struct PolicyF32 {
    layers: Vec<Layer>,
    flow: Option<Flow>,
    execute: usize,
    contract: Contract,
    queue: VecDeque<[f32; ACT_DIM]>,
}

/// The denoising of a flow: Euler steps from time 0 to 1.
#[derive(Debug)]
struct Flow {
    normalize: Op,
    /// Frequencies: the network reads cosine and sine of the time at these, alternating.
    freq: Vec<f32>,
    steps: usize,
    /// Values of a chunk.
    len: usize,
    noise: Random,
}

#[derive(Debug)]
struct Layer {
    /// Names of the concatenated inputs; without names, the previous output.
    input: Vec<String>,
    op: Op,
    /// Name of the stored output.
    save: Option<String>,
}

#[derive(Debug)]
enum Op {
    Normalize {
        mean: Vec<f32>,
        scale: Vec<f32>,
        clip: Option<f32>,
    },
    /// Weights are row-major, one row for each output.
    Linear {
        weight: Vec<f32>,
        bias: Vec<f32>,
    },
    Relu,
    LayerNorm {
        weight: Vec<f32>,
        bias: Vec<f32>,
        eps: f32,
    },
    Add {
        with: String,
    },
}

/// From network output to joint velocity (rad/s): `raw * scale + offset`, then clamped to `[low, high]`.
#[derive(Debug)]
struct Contract {
    scale: [f32; ACT_DIM],
    offset: [f32; ACT_DIM],
    low: [f32; ACT_DIM],
    high: [f32; ACT_DIM],
}

impl PolicyF32 {
    /// Loads `policy.json` and `policy.safetensors` from the folder `dir`.
    ///
    /// # Errors
    /// A file is missing or malformed, or the policy does not map [`OBS_DIM`] observations to chunks of [`ACT_DIM`]
    /// actions.
    pub fn load(dir: &Path) -> Result<Self> {
        let json_path = dir.join("policy.json");
        let tensor_path = dir.join("policy.safetensors");
        let json = std::fs::read_to_string(&json_path).with_context(|| format!("read {}", json_path.display()))?;
        let bytes = std::fs::read(&tensor_path).with_context(|| format!("read {}", tensor_path.display()))?;
        let spec: Value = serde_json::from_str(&json).with_context(|| format!("parse {}", json_path.display()))?;
        let tensors = SafeTensors::deserialize(&bytes).with_context(|| format!("parse {}", tensor_path.display()))?;
        Self::build(&spec, &tensors).with_context(|| format!("policy in {}", dir.display()))
    }

    fn build(spec: &Value, tensors: &SafeTensors<'_>) -> Result<Self> {
        let chunk = count(spec, "chunk")?;
        let execute = count(spec, "execute")?;
        ensure!((1..=chunk).contains(&execute), "execute = {execute} is not within 1..={chunk}");
        for (key, expected) in [("obs_dim", OBS_DIM), ("act_dim", ACT_DIM)] {
            let found = count(spec, key)?;
            ensure!(found == expected, "{key} is {found}, this task has {expected}");
        }

        let flow = match text(spec, "kind")? {
            "chunk" => None,
            "flow" => Some(Flow::read(spec, tensors, chunk * ACT_DIM)?),
            other => bail!("kind {other:?} is not supported"),
        };
        let mut layers = Vec::new();
        let mut width = OBS_DIM;
        let mut saved = flow.as_ref().map_or_else(HashMap::new, |flow| {
            let slots = [("obs", OBS_DIM), ("tfeat", 2 * flow.freq.len()), ("x", flow.len)];
            HashMap::from(slots.map(|(name, len)| (name.to_owned(), len)))
        });
        for (i, op) in list(spec, "ops")?.iter().enumerate() {
            let context = || format!("op {i}");
            let input = inputs(op).with_context(context)?;
            if !input.is_empty() {
                let len = |name: &String| saved.get(name).with_context(|| format!("no input {name:?}"));
                width = input.iter().map(len).sum::<Result<usize>>().with_context(context)?;
            }
            let layer_op = read_op(op, tensors, width, &saved).with_context(context)?;
            if let Op::Linear { bias, .. } = &layer_op {
                width = bias.len();
            }
            let save = op.get("save").map(|_| text(op, "save")).transpose().with_context(context)?;
            if let Some(name) = save {
                saved.insert(name.to_owned(), width);
            }
            layers.push(Layer { input, op: layer_op, save: save.map(str::to_owned) });
        }
        ensure!(width == chunk * ACT_DIM, "the last op has {width} outputs, chunk * act_dim is {}", chunk * ACT_DIM);

        let action = spec.get("action").context("no `action` object")?;
        let contract = Contract {
            scale: numbers(action, "scale")?,
            offset: numbers(action, "offset")?,
            low: numbers(action, "low")?,
            high: numbers(action, "high")?,
        };
        ensure!(contract.low.iter().zip(&contract.high).all(|(low, high)| low <= high), "`action`: low is above high");
        Ok(Self { layers, flow, execute, contract, queue: VecDeque::new() })
    }

    /// Clears the queued actions and restarts the noise; call it before every episode.
    pub fn reset(&mut self) {
        self.queue.clear();
        if let Some(flow) = &mut self.flow {
            flow.noise = Random::new(NOISE_SEED);
        }
    }

    /// Returns `true` if its output depends on noise.
    pub fn draws(&self) -> bool {
        self.flow.is_some()
    }

    /// Returns the next action (joint velocities, rad/s) for the observation `obs` ([`OBS_DIM`] values).
    ///
    /// # Panics
    /// `obs` has another length.
    pub fn act(&mut self, obs: &[f32]) -> [f32; ACT_DIM] {
        if self.queue.is_empty() {
            let raw = self.raw(obs);
            let (actions, _) = raw.as_chunks::<ACT_DIM>();
            self.queue.extend(actions.iter().take(self.execute).map(|action| self.contract.apply(action)));
        }
        self.queue.pop_front().expect("execute is at least 1")
    }

    /// Computes the network's output for `obs` ([`OBS_DIM`] values): normalised actions, chunk step by chunk step.
    ///
    /// # Panics
    /// `obs` has another length.
    pub fn raw(&mut self, obs: &[f32]) -> Vec<f32> {
        assert_eq!(obs.len(), OBS_DIM, "length of the observation");
        match &mut self.flow {
            None => run(&self.layers, obs.to_vec(), HashMap::new()),
            Some(flow) => flow.chunk(&self.layers, obs.to_vec()),
        }
    }
}

/// Runs layers on `x`, and on the values that they read by name.
fn run<'a>(layers: &'a [Layer], mut x: Vec<f32>, mut saved: HashMap<&'a str, Vec<f32>>) -> Vec<f32> {
    for layer in layers {
        if !layer.input.is_empty() {
            x = layer.input.iter().flat_map(|name| &saved[name.as_str()]).copied().collect();
        }
        layer.op.apply(&mut x, &saved);
        if let Some(name) = &layer.save {
            saved.insert(name, x.clone());
        }
    }
    x
}

impl Flow {
    fn read(spec: &Value, tensors: &SafeTensors<'_>, len: usize) -> Result<Self> {
        let vector = |name: &str| tensor(tensors, name, &[OBS_DIM]);
        let [mean, scale] = [vector("obs_norm.mean")?, vector("obs_norm.scale")?];
        let freq = tensors.tensor("time.freq").context("tensor time.freq")?.shape().to_vec();
        let steps = count(spec, "steps")?;
        ensure!(steps > 0, "steps is 0");
        Ok(Self {
            normalize: Op::Normalize { mean, scale, clip: Some(OBS_CLIP) },
            freq: tensor(tensors, "time.freq", &freq)?,
            steps,
            len,
            noise: Random::new(NOISE_SEED),
        })
    }

    fn chunk(&mut self, layers: &[Layer], mut obs: Vec<f32>) -> Vec<f32> {
        self.normalize.apply(&mut obs, &HashMap::new());
        let mut x: Vec<f32> = (0..self.len).map(|_| self.noise.normal() as f32).collect();
        let h = 1.0 / self.steps as f32;
        for step in 0..self.steps {
            let angles = self.freq.iter().map(|f| TAU * f64::from(h * step as f32 * f));
            let tfeat = angles.clone().map(libm::cos).chain(angles.map(libm::sin)).map(|v| v as f32).collect();
            let slots = HashMap::from([("obs", obs.clone()), ("tfeat", tfeat), ("x", x.clone())]);
            for (x, v) in x.iter_mut().zip(run(layers, Vec::new(), slots)) {
                *x += h * v;
            }
        }
        x
    }
}

impl Contract {
    fn apply(&self, raw: &[f32; ACT_DIM]) -> [f32; ACT_DIM] {
        core::array::from_fn(|i| (raw[i] * self.scale[i] + self.offset[i]).clamp(self.low[i], self.high[i]))
    }
}

impl Op {
    fn apply(&self, x: &mut Vec<f32>, saved: &HashMap<&str, Vec<f32>>) {
        match self {
            Self::Normalize { mean, scale, clip } => {
                for ((x, mean), scale) in x.iter_mut().zip(mean).zip(scale) {
                    *x = (*x - mean) * scale;
                    if let Some(clip) = clip {
                        *x = x.clamp(-clip, *clip);
                    }
                }
            }
            Self::Linear { weight, bias } => {
                let rows = weight.chunks_exact(x.len());
                *x = rows
                    .zip(bias)
                    .map(|(row, bias)| bias + row.iter().zip(&*x).map(|(w, x)| w * x).sum::<f32>())
                    .collect();
            }
            Self::Relu => x.iter_mut().for_each(|x| *x = x.max(0.0)),
            Self::LayerNorm { weight, bias, eps } => {
                let count = x.len() as f32;
                let mean = x.iter().sum::<f32>() / count;
                let variance = x.iter().map(|x| (x - mean) * (x - mean)).sum::<f32>() / count;
                let factor = 1.0 / (variance + eps).sqrt();
                for ((x, weight), bias) in x.iter_mut().zip(weight).zip(bias) {
                    *x = (*x - mean) * factor * weight + bias;
                }
            }
            Self::Add { with } => {
                for (x, other) in x.iter_mut().zip(&saved[with.as_str()]) {
                    *x += other;
                }
            }
        }
    }
}

/// Reads one op whose input has `width` values, and checks every shape so that running it cannot fail.
fn read_op(op: &Value, tensors: &SafeTensors<'_>, width: usize, saved: &HashMap<String, usize>) -> Result<Op> {
    let vector = |key: &str, len: usize| tensor(tensors, text(op, key)?, &[len]);
    Ok(match text(op, "op")? {
        "normalize" => Op::Normalize {
            mean: vector("mean", width)?,
            scale: vector("scale", width)?,
            clip: op.get("clip").map(|_| positive(op, "clip")).transpose()?,
        },
        "linear" => {
            let name = text(op, "w")?;
            let shape = tensors.tensor(name).with_context(|| format!("tensor {name}"))?.shape().to_vec();
            let outputs = *shape.first().with_context(|| format!("tensor {name} has no dimension"))?;
            Op::Linear { weight: tensor(tensors, name, &[outputs, width])?, bias: vector("b", outputs)? }
        }
        "relu" => Op::Relu,
        "layernorm" => {
            Op::LayerNorm { weight: vector("w_ln", width)?, bias: vector("b_ln", width)?, eps: positive(op, "eps")? }
        }
        "add" => {
            let with = text(op, "with")?;
            ensure!(saved.get(with) == Some(&width), "no output of width {width} was saved as {with:?}");
            Op::Add { with: with.to_owned() }
        }
        other => bail!("op {other:?} is not supported"),
    })
}

/// Reads the `f32` tensor `name`, which must have shape `shape`.
fn tensor(tensors: &SafeTensors<'_>, name: &str, shape: &[usize]) -> Result<Vec<f32>> {
    let view = tensors.tensor(name).with_context(|| format!("tensor {name}"))?;
    ensure!(view.dtype() == Dtype::F32, "tensor {name} has type {:?}, expected F32", view.dtype());
    ensure!(view.shape() == shape, "tensor {name} has shape {:?}, expected {shape:?}", view.shape());
    let (values, _) = view.data().as_chunks::<4>();
    Ok(values.iter().map(|&bytes| f32::from_le_bytes(bytes)).collect())
}

/// Parses the names in `input`: none, one, or a list.
fn inputs(op: &Value) -> Result<Vec<String>> {
    let name = |name: &Value| name.as_str().map(str::to_owned);
    match op.get("input") {
        None => Some(Vec::new()),
        Some(Value::Array(names)) => names.iter().map(name).collect::<Option<_>>(),
        Some(one) => name(one).map(|name| vec![name]),
    }
    .context("`input` is not a name or a list of names")
}

fn text<'a>(object: &'a Value, key: &str) -> Result<&'a str> {
    object.get(key).and_then(Value::as_str).with_context(|| format!("{key:?} is not text"))
}

fn list<'a>(object: &'a Value, key: &str) -> Result<&'a [Value]> {
    object.get(key).and_then(Value::as_array).map(Vec::as_slice).with_context(|| format!("{key:?} is not a list"))
}

fn count(object: &Value, key: &str) -> Result<usize> {
    let number = object.get(key).and_then(Value::as_u64).with_context(|| format!("{key:?} is not a whole number"))?;
    // The bound keeps products of sizes far from overflow.
    ensure!(number <= 1 << 16, "{key:?} = {number} is too large");
    Ok(number as usize)
}

fn positive(object: &Value, key: &str) -> Result<f32> {
    let number = object.get(key).and_then(Value::as_f64).with_context(|| format!("{key:?} is not a number"))?;
    ensure!(number > 0.0, "{key:?} = {number} is not positive");
    Ok(number as f32)
}

fn numbers(object: &Value, key: &str) -> Result<[f32; ACT_DIM]> {
    let values: Option<Vec<f32>> = list(object, key)?.iter().map(|x| x.as_f64().map(|x| x as f32)).collect();
    values.and_then(|values| values.try_into().ok()).with_context(|| format!("{key:?} is not {ACT_DIM} numbers"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use safetensors::tensor::TensorView;
    use serde_json::json;

    /// Loads a network of one linear layer with zero weights and bias 0, 1, 2, ... for chunks of `chunk` actions.
    fn linear_policy(chunk: usize, change: impl Fn(&mut Value)) -> Result<PolicyF32> {
        let outputs = chunk * ACT_DIM;
        let weight = vec![0; outputs * OBS_DIM * 4];
        let bias: Vec<u8> = (0..outputs).flat_map(|i| (i as f32).to_le_bytes()).collect();
        let views = [
            ("w", TensorView::new(Dtype::F32, vec![outputs, OBS_DIM], &weight)?),
            ("b", TensorView::new(Dtype::F32, vec![outputs], &bias)?),
        ];
        let bytes = safetensors::serialize(views, None)?;
        let mut spec = json!({
            "kind": "chunk", "chunk": chunk, "execute": 2, "obs_dim": OBS_DIM, "act_dim": ACT_DIM,
            "ops": [{"op": "linear", "w": "w", "b": "b"}],
            "action": {"scale": [2, 2, 2, 2, 2, 2], "offset": [1, 1, 1, 1, 1, 1],
                       "low": [0, 0, 0, 0, 0, 0], "high": [20, 20, 20, 20, 20, 20]},
        });
        change(&mut spec);
        PolicyF32::build(&spec, &SafeTensors::deserialize(&bytes)?)
    }

    #[test]
    fn chunk_actions_pass_through_the_contract() {
        let mut policy = linear_policy(3, |_| ()).unwrap();
        let obs = [0.0; OBS_DIM];
        assert_eq!(policy.raw(&obs).len(), 3 * ACT_DIM);
        let first = [1.0, 3.0, 5.0, 7.0, 9.0, 11.0];
        assert_eq!(policy.act(&obs), first);
        assert_eq!(policy.act(&obs), [13.0, 15.0, 17.0, 19.0, 20.0, 20.0]);
        assert_eq!(policy.act(&obs), first);
        policy.reset();
        assert_eq!(policy.act(&obs), first);
    }

    #[test]
    fn layernorm_matches_a_worked_example() {
        let op = Op::LayerNorm { weight: vec![1.0, 2.0], bias: vec![0.5, 0.0], eps: 1e-12 };
        let mut x = vec![1.0, 3.0];
        op.apply(&mut x, &HashMap::new());
        assert_eq!(x, [-0.5, 2.0]);
    }

    #[test]
    fn malformed_policies_are_refused() {
        for (key, value) in [
            ("chunk", json!(4)),
            ("kind", json!("diffusion")),
            ("kind", json!("flow")),
            ("ops", json!([{"op": "linear", "w": "w", "b": "b", "input": ["x"]}])),
            ("execute", json!(0)),
            ("execute", json!(4)),
            ("obs_dim", json!(3)),
            ("ops", json!([{"op": "softmax"}])),
            ("ops", json!([{"op": "add", "with": "h0"}])),
            ("ops", json!([{"op": "linear", "w": "b", "b": "b"}])),
            ("action", json!({"scale": [1]})),
        ] {
            assert!(linear_policy(3, |spec| spec[key] = value.clone()).is_err(), "{key} = {value}");
        }
        assert!(PolicyF32::load(Path::new("no-such-folder")).is_err());
    }
}
