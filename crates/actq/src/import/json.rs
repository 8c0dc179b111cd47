//! `policy.json`: its permitted keys, and their values as f32.

use actq_kernels::image::Kind;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::contract::{JsonContract, JsonEnsemble};
use super::denoising::{self, JsonDenoising};
use crate::contract::{ActionContract, Ensemble, Playback};
use crate::error::{Context, Result, bail};
use crate::graph::NodeKind;
use crate::strict_json;
use crate::text::is_control;

#[derive(Clone, Debug, Default, Deserialize, Serialize)]
pub struct PolicyJson {
    pub name: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kind: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chunk: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub execute: Option<usize>,
    pub obs_dim: usize,
    pub act_dim: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub control_hz: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub action: Option<JsonContract>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ensemble: Option<JsonEnsemble>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub overlap: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub deadline: Option<usize>,
    #[serde(flatten)]
    pub denoising: JsonDenoising,
    /// [`PolicySource::files`](super::PolicySource::files) writes them, one per line.
    #[serde(skip_serializing)]
    pub ops: Vec<JsonOp>,
}

/// Keys of [`PolicyJson`].
const KEYS: [&str; 12] = [
    "name",
    "kind",
    "chunk",
    "execute",
    "ensemble",
    "overlap",
    "deadline",
    "obs_dim",
    "act_dim",
    "control_hz",
    "action",
    "ops",
];
/// Keys about a policy's origin. Their values are not read.
const ABOUT: [&str; 8] = ["source", "commit", "source_path", "license", "recurrent", "n_params", "inputs", "states"];

/// The op that only names or joins values.
pub(super) const IDENTITY: &str = "identity";

/// One op. [`NodeKind::syntax`] lists the keys of each beside these.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct JsonOp {
    pub op: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub input: Option<Input>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub save: Option<String>,
    #[serde(flatten, with = "in_order")]
    keys: Vec<(String, Value)>,
}

/// Keys of an op as a JSON object, written in their order.
mod in_order {
    use serde::{Deserialize, Deserializer, Serializer};
    use serde_json::{Map, Value};

    pub(super) fn serialize<S: Serializer>(keys: &[(String, Value)], to: S) -> Result<S::Ok, S::Error> {
        to.collect_map(keys.iter().map(|(key, value)| (key, value)))
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<(String, Value)>, D::Error> {
        Ok(Map::deserialize(from)?.into_iter().collect())
    }
}

impl JsonOp {
    /// Makes an op without keys of its own.
    pub fn new(op: &str) -> Self {
        Self { op: op.to_owned(), input: None, save: None, keys: Vec::new() }
    }

    /// Appends a key, if it has a value.
    #[must_use]
    pub fn key(mut self, key: &str, value: Option<impl Into<Value>>) -> Self {
        self.keys.extend(value.map(|value| (key.to_owned(), value.into())));
        self
    }

    /// Returns the value of a key; null counts as absent.
    pub(super) fn get(&self, key: &str) -> Option<&Value> {
        self.keys.iter().find(|(name, value)| name == key && !value.is_null()).map(|(_, value)| value)
    }
}

#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(untagged)]
pub enum Input {
    One(String),
    Many(Vec<String>),
}

impl PolicyJson {
    /// Parses the file, and refuses unknown keys: ignoring one would change the policy.
    pub fn parse(bytes: &[u8]) -> Result<Self> {
        const WRONG: &str = "not a policy description";
        let value = strict_json::parse(bytes).context(WRONG)?;
        // An unknown kind must be refused before its keys are.
        let iterative = kind(value["kind"].as_str())?.is_iterative();
        let keys = [&KEYS[..], if iterative { &denoising::KEYS } else { &[] }].concat();
        if let Some(key) = given(&value).find(|key| !keys.contains(key) && !ABOUT.contains(key)) {
            let (keys, about) = (keys.join(", "), ABOUT.join(", "));
            bail!("the key {key:?} is not known; the keys are {keys} and, not read, {about}");
        }
        let ops = NodeKind::syntax();
        for (i, op) in value["ops"].as_array().into_iter().flatten().enumerate() {
            let Some(name) = op["op"].as_str() else { continue };
            let own = ops.iter().find(|(op, _)| *op == name).map(|(_, keys)| *keys);
            let Some(own) = own.or((name == IDENTITY).then_some(&[])) else { continue };
            let keys = [&["op", "input", "save"], own].concat();
            if let Some(key) = given(op).find(|key| !keys.contains(key)) {
                bail!("op {i} ({name}) has the key {key:?}; its keys are {}", keys.join(", "));
            }
        }
        for (place, value) in [("name", &value["name"]), ("ops", &value["ops"])] {
            check_text(place, value)?;
        }
        serde_json::from_slice(bytes).context(WRONG)
    }

    /// As [`Self::parse`], refuses control characters in names.
    pub(super) fn check_text(&self) -> Result<()> {
        check_text("name", &Value::from(self.name.as_str()))?;
        check_text("ops", &serde_json::to_value(&self.ops)?)
    }

    pub fn kind(&self) -> Result<Kind> {
        kind(self.kind.as_deref())
    }

    /// Returns the values of the prefix: keys and values of every token of the ops that read one. (The ops refuse keys
    /// of another type.)
    pub(super) fn prefix_len(&self) -> usize {
        let count = |op: &JsonOp, key: &str| op.get(key).and_then(Value::as_u64).unwrap_or(0) as usize;
        let of_op = |op: &JsonOp| {
            let kv_heads = if op.get("kv_heads").is_some() { count(op, "kv_heads") } else { count(op, "heads") };
            [count(op, "prefix"), kv_heads, count(op, "dim")].into_iter().fold(2usize, usize::saturating_mul)
        };
        self.ops.iter().map(of_op).fold(0, usize::saturating_add)
    }

    /// Returns the action contract. Without the key `action`, chunked policies are limited to -1..1, as in the format's
    /// reference runtime.
    pub fn contract(&self, kind: Kind) -> Result<ActionContract> {
        let contract = match &self.action {
            Some(json) => json.contract(self.act_dim)?,
            None => {
                let limit = |at: f32| (kind != Kind::Step).then(|| vec![at; self.act_dim]);
                ActionContract { low: limit(-1.0), high: limit(1.0), ..ActionContract::default() }
            }
        };
        let ensemble = self.ensemble.as_ref().map(|json| Ensemble { horizon: json.horizon, m: json.m.unwrap_or(0.01) });
        let playback = Playback { ensemble, overlap: self.overlap.unwrap_or(0), deadline: self.deadline };
        Ok(ActionContract { playback, ..contract })
    }

    /// Returns the default number of executed actions of a chunk: all, but one for an ensemble.
    pub fn execute(&self, chunk: usize) -> usize {
        self.execute.unwrap_or(if self.ensemble.is_some() { 1 } else { chunk })
    }
}

/// Returns the keys of an object that have a value; null counts as absent.
fn given(object: &Value) -> impl Iterator<Item = &str> {
    object.as_object().into_iter().flatten().filter(|(_, value)| !value.is_null()).map(|(key, _)| key.as_str())
}

fn kind(name: Option<&str>) -> Result<Kind> {
    match name {
        None | Some("step") => Ok(Kind::Step),
        Some("chunk") => Ok(Kind::Chunk),
        Some("flow") => Ok(Kind::Flow),
        Some("diffusion") => Ok(Kind::Diffusion),
        Some(other) => bail!("kind {other:?} is not known; use step, chunk, flow or diffusion"),
    }
}

/// Refuses control characters in the text within `value`, since names are printed.
fn check_text(place: &str, value: &Value) -> Result<()> {
    match value {
        Value::String(text) => {
            let control = text.chars().find(|c| is_control(*c));
            let Some(c) = control else { return Ok(()) };
            bail!("{place} {text:?} holds the control character U+{:04X}", u32::from(c));
        }
        Value::Array(items) => {
            items.iter().enumerate().try_for_each(|(i, item)| check_text(&format!("{place}[{i}]"), item))
        }
        Value::Object(entries) => {
            entries.iter().try_for_each(|(key, value)| check_text(&format!("{place}.{}", key.escape_debug()), value))
        }
        _ => Ok(()),
    }
}
