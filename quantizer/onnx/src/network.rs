//! Conversion of a file to the two files of a policy folder: chooses the action output and the observed inputs, and
//! converts the network between them.

mod choice;
mod files;
mod output;

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use actq::error::{Context as _, Result, bail, ensure};
use actq::import::Importer;
use actq::import::contract::JsonContract;
use actq::import::json::PolicyJson;
use actq::policy::Policy;
use actq::text::printable;
use prost::bytes::Bytes;

pub use self::choice::Choice;
use self::files::{tensors, text};
use self::output::{actions, choose, refuse_batch};
use crate::action;
use crate::file::model::Model;
use crate::lower::lower;
use crate::nodes::follow::{Follower, INTEGERS};
use crate::patterns::simplify::simplify;
use crate::states::{Cells, Output, refuse_lost_states};
use crate::values::elements::value;
use crate::values::expr::{Expr, Exprs, Id};
use crate::values::tensor::{Element, Tensor};

/// The files of an imported policy, and a summary of the import.
#[derive(Clone, Debug)]
pub struct Imported {
    /// policy.json
    pub json: Vec<u8>,
    /// policy.safetensors
    pub weights: Vec<u8>,
    /// Exporter of the file.
    pub producer: String,
    /// Observed inputs, with their lengths. The observation is their concatenation in this order.
    pub inputs: Vec<(String, usize)>,
    /// Observed inputs that the file takes as integers. The observation holds them as integers in float32.
    pub integers: Vec<String>,
    /// Inputs that hold recurrent state, the outputs of their next values, and their lengths.
    pub states: Vec<(String, String, usize)>,
    /// The action output, and its number of values.
    pub output: (String, usize),
    /// Names of the ops in order.
    pub ops: Vec<String>,
    /// Inputs that the action does not depend on.
    pub cut_inputs: Vec<String>,
    /// Outputs that are neither the action nor states.
    pub cut_outputs: Vec<String>,
    /// Number of nodes in the file.
    pub nodes: usize,
    /// Keys of the action contract that come from the file's last nodes.
    pub contract: Vec<&'static str>,
    /// Number of actions whose limits are the bounds of their last operation, such as tanh.
    pub bounded: usize,
}

/// Imports an ONNX file. An error names the file, and the node if known.
pub fn import(path: &Path, choice: &Choice) -> Result<Imported> {
    let name = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let imported = Model::read(path).and_then(|model| network(&model, &name, choice));
    imported.with_context(|| path.display().to_string())
}

/// Returns the values of an output that depends on no input; `None` if it depends on one.
///
/// # Errors
///
/// If the file cannot be read, or has no such output.
pub fn constant(path: &Path, output: &str) -> Result<Option<Vec<f64>>> {
    let value = || -> Result<Tensor> {
        let model = Model::read(path)?;
        Follower::new(&model).value(output)
    };
    let value = value().with_context(|| path.display().to_string())?;
    let known = |element| if let Element::Known(number) = element { Some(number) } else { None };
    Ok(value.elements().into_iter().map(known).collect())
}

/// Imports a file's bytes as [`import`] does, with external tensors from `folder`.
pub fn import_bytes(bytes: Vec<u8>, folder: &Path, name: &str, choice: &Choice) -> Result<Imported> {
    network(&Model::parse(Bytes::from(bytes), folder)?, name, choice)
}

/// Importer of ONNX files, without choices.
#[derive(Clone, Copy, Debug)]
pub struct Onnx;

impl Importer for Onnx {
    fn accepts(&self, path: &Path) -> bool {
        path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("onnx"))
    }

    fn files(&self, path: &Path) -> Vec<PathBuf> {
        let external = Model::read(path).map(|model| model.external_files()).unwrap_or_default();
        [path.to_owned()].into_iter().chain(external).collect()
    }

    fn load(&self, path: &Path) -> Result<Policy> {
        let imported = import(path, &Choice::default())?;
        Policy::of_files(path, [path, path], &imported.json, &imported.weights)
    }
}

fn network(model: &Model, name: &str, choice: &Choice) -> Result<Imported> {
    choice.check(&model.graph)?;
    let mut follower = Follower::new(model);
    let mut outputs = Vec::new();
    let mut errors = Vec::new();
    for port in &model.graph.outputs {
        match follower.value(&port.name) {
            Ok(value) => outputs.push(Output { name: port.name.clone(), value }),
            Err(error) => errors.push((port.name.clone(), error)),
        }
    }
    if let Some(inner) = &choice.output
        && !outputs.iter().any(|output| output.name == *inner)
    {
        let value = follower.value(inner).with_context(|| format!("output {:?}", printable(inner)))?;
        outputs.push(Output { name: inner.clone(), value });
    }
    let mut exprs = follower.exprs;
    let cells = Cells::find(model, &mut exprs, &outputs, &choice.states);
    let chosen = choose(&exprs, &cells, &outputs, errors, choice)?;
    let (action, act_shape) = (outputs[chosen].name.clone(), outputs[chosen].value.shape.clone());

    let values = Tensor::of_elements(act_shape.clone(), cells.elements(&outputs[chosen].value)).elements();
    // A constant value becomes another value times 0, plus an offset.
    let first = values.iter().find_map(value).with_context(|| {
        format!("output {:?} depends on no input; choose another by --output NAME", printable(&action))
    })?;
    let open: Vec<(Id, usize)> = values.iter().map(|element| value(element).unwrap_or(first)).collect();
    let parts = |e: &Element| if let Element::Known(v) = e { (0.0, *v) } else { (1.0, 0.0) };
    let (scale, offset) = values.iter().map(parts).unzip();
    let root = exprs.vector(&open);
    let root = exprs.affine(root, scale, offset);
    let live = exprs.needed_instead(&[root], &cells.instead);
    if let Some(i) = live.iter().find_map(|&id| if let Expr::Integers(i) = exprs.get(id) { Some(*i) } else { None }) {
        bail!(
            "the action is computed with the integers of the input {:?}, and an observation is float32; cast the input to float32 \
             first",
            printable(&model.graph.inputs[i].name)
        );
    }
    let pairs = cells.pairs(model, &exprs, &live, &outputs)?;
    let mut read: Vec<usize> =
        live.iter().filter_map(|&id| if let Expr::Input(i) = exprs.get(id) { Some(*i) } else { None }).collect();
    read.sort_unstable();
    if !choice.is_fed {
        refuse_lost_states(model, &read, &pairs, &outputs, &action, &choice.states)?;
    }
    read.retain(|i| !pairs.iter().any(|(state, _)| state == i));
    ensure!(!read.is_empty(), "output {:?} depends on no input; choose another by --output NAME", printable(&action));

    let len_of = |exprs: &Exprs, i: usize| {
        live.iter().find(|&&id| *exprs.get(id) == Expr::Input(i)).map_or(0, |&id| exprs.len_of(id))
    };
    let mut offsets = HashMap::new();
    let mut inputs = Vec::new();
    let mut integers = Vec::new();
    let mut obs_len = 0;
    for &i in &read {
        let len = len_of(&exprs, i);
        offsets.insert(i, obs_len);
        obs_len += len;
        let port = &model.graph.inputs[i];
        inputs.push((printable(&port.name).into_owned(), len));
        integers.extend(INTEGERS.contains(&port.kind).then(|| printable(&port.name).into_owned()));
    }
    let states: Vec<(String, String, usize)> = pairs
        .iter()
        .map(|&(i, o)| {
            let names = [&model.graph.inputs[i].name, &outputs[o].name].map(|name| printable(name).into_owned());
            let [from, to] = names;
            (from, to, outputs[o].value.len())
        })
        .collect();

    let (chunk, act_len) = if choice.is_fed {
        (1, open.len())
    } else {
        refuse_batch(model, &read, &act_shape)?;
        actions(&act_shape, open.len())?
    };
    let (root, contract) = action::contract(&exprs, root, act_len);
    let last = contract.iter().flat_map(keys).collect();
    let (contract, bounded) = action::bounded(&exprs, root, contract, act_len);
    let root = simplify(&mut exprs, root, &cells.instead);
    let lowered = lower(&exprs, root, &offsets, obs_len).map_err(|(id, error)| at_node(model, &exprs, id, error))?;
    let used = |name: &str| inputs.iter().any(|(n, _)| n == name) || states.iter().any(|(n, ..)| n == name);
    let shown = |name: &String| printable(name).into_owned();
    let cut_inputs: Vec<String> = model
        .graph
        .inputs
        .iter()
        .filter(|port| !model.graph.initializers.contains_key(&port.name))
        .map(|port| shown(&port.name))
        .filter(|name| !used(name))
        .collect();
    let is_cut = |name: &String| *name != shown(&action) && !states.iter().any(|(_, to, _)| to == name);
    let cut_outputs = model.graph.outputs.iter().map(|port| shown(&port.name)).filter(is_cut).collect();
    let json = PolicyJson {
        name: printable(name).chars().take(50).collect(),
        kind: (chunk > 1).then(|| "chunk".to_owned()),
        chunk: (chunk > 1).then_some(chunk),
        obs_dim: obs_len,
        act_dim: act_len,
        // Without a contract, the actions of a chunk would be limited to -1 .. 1.
        action: contract.or_else(|| (chunk > 1).then(JsonContract::default)),
        ops: Vec::new(),
        ..PolicyJson::default()
    };
    let ops = lowered.ops.iter().map(|op| op.op.clone()).collect();
    let source = format!("ONNX by {}", model.producer);
    let json = text(json, &lowered, &inputs, &states, &source)?;
    Ok(Imported {
        json,
        weights: tensors(&lowered)?,
        producer: model.producer.clone(),
        inputs,
        integers,
        states,
        output: (shown(&action), open.len()),
        ops,
        cut_inputs,
        cut_outputs,
        nodes: model.graph.nodes.len(),
        contract: last,
        bounded,
    })
}

fn keys(contract: &JsonContract) -> Vec<&'static str> {
    let all =
        [("scale", &contract.scale), ("offset", &contract.offset), ("low", &contract.low), ("high", &contract.high)];
    all.into_iter().filter(|(_, values)| values.is_some()).map(|(name, _)| name).collect()
}

fn at_node(model: &Model, exprs: &Exprs, id: Id, error: actq::error::Error) -> actq::error::Error {
    let at = exprs.origin(id);
    match model.graph.nodes.get(at) {
        Some(node) => error.context(format!("node {at} {:?} ({})", node.name, node.op)),
        None => error,
    }
}
