//! Conversion of a file to a policy folder in memory: chooses the action output and the observed inputs, and
//! converts the network between them.

mod denoiser;
mod observation;
mod options;
mod output;
mod remarks;

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use actq::error::{Context as _, Error, Result, ensure};
use actq::import::contract::JsonContract;
use actq::import::json::PolicyJson;
use actq::import::{Importer, PolicySource};
use actq::policy::Policy;
use actq::text::{count, printable};
use prost::bytes::Bytes;

pub use self::denoiser::Denoiser;
use self::denoiser::Places;
use self::observation::{Observation, named_states, observed_inputs, prefix_inputs, read_inputs, refuse_integers};
pub use self::options::ImportOptions;
use self::output::{actions, choose, refuse_batch, refuse_column, refused_actions};
use crate::action;
use crate::file::model::Model;
use crate::lower::{Offsets, lower};
use crate::nodes::attention::{PRODUCT, SOFTMAX};
use crate::nodes::follow::Follower;
use crate::patterns::simplify::simplify;
use crate::signature::Signature;
use crate::states::{Cells, Chosen, Output};
use crate::values::elements::{needed, value};
use crate::values::expr::{Expr, Exprs, Id};
use crate::values::tensor::{Element, Tensor};

/// An imported policy, and a summary of the import.
#[derive(Clone, Debug)]
pub struct Imported {
    /// The policy folder.
    pub source: PolicySource,
    /// Exporter of the file.
    pub producer: String,
    /// Observed inputs, with their lengths. The observation is their concatenation in this order.
    pub inputs: Vec<(String, usize)>,
    /// Observed inputs that the file takes as integers. The observation holds them as integers in float32.
    pub integers: Vec<String>,
    /// Inputs of keys and values that a host sends.
    pub prefix: Prefix,
    /// Inputs of a denoiser that are not observed.
    pub denoiser: Option<Denoiser>,
    /// Inputs that hold recurrent state, the outputs of their next values, and their lengths.
    pub states: Vec<(String, String, usize)>,
    /// The action output, and its number of values.
    pub output: (String, usize),
    /// Indices of the action's values that depend on no input.
    pub constant: Vec<usize>,
    /// Names of the ops in order.
    pub ops: Vec<String>,
    /// Inputs that the action does not depend on.
    pub cut_inputs: Vec<String>,
    /// Outputs that are neither the action nor states.
    pub cut_outputs: Vec<String>,
    /// Outputs named action that cannot be imported, with the reasons; another one is the action.
    pub refused: Vec<(String, String)>,
    /// Number of nodes in the file.
    pub nodes: usize,
    /// Keys of the action contract that come from the file's last nodes.
    pub contract: Vec<&'static str>,
    /// Number of actions whose limits are the bounds of their last operation, such as tanh.
    pub bounded: usize,
    /// Nodes before the action that replace or limit NaN and infinity, with what they do. The policy has no such nodes.
    pub guards: Vec<String>,
    /// Axes of the inputs, after the first, that have no length; each is taken as 1.
    pub unsized_axes: Vec<String>,
    /// Reasons why the file is invalid, although its network can be read.
    pub faults: Vec<String>,
}

/// Inputs of a file that are keys and values of a prefix.
#[derive(Clone, Debug, Default)]
pub struct Prefix {
    /// Names and lengths of the inputs.
    pub inputs: Vec<(String, usize)>,
    /// For each value of the policy's prefix, which follows the observation, its place in these inputs, one after the
    /// other.
    pub order: Vec<usize>,
}

/// A parsed ONNX file. Its errors name the file.
#[derive(Debug)]
pub struct OnnxFile {
    path: PathBuf,
    model: Model,
}

impl OnnxFile {
    /// Reads and parses a file.
    ///
    /// # Errors
    ///
    /// If it cannot be read, or is not ONNX.
    pub fn read(path: &Path) -> Result<Self> {
        let model = Model::read(path).with_context(|| path.display().to_string())?;
        Ok(Self { path: path.to_owned(), model })
    }

    /// Returns the path that it was read from.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns its inputs, outputs and metadata.
    pub fn signature(&self) -> Signature {
        Signature::of(&self.model)
    }

    /// Imports its network.
    ///
    /// # Errors
    ///
    /// If a part of it is not supported; names the node if known.
    pub fn import(&self, options: &ImportOptions) -> Result<Imported> {
        let name = self.path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        import_model(&self.model, &name, options).with_context(|| self.path.display().to_string())
    }

    /// Returns the values of an output that depends on no input; `None` if it depends on one.
    ///
    /// # Errors
    ///
    /// If the file has no such output.
    pub fn constant(&self, output: &str) -> Result<Option<Vec<f64>>> {
        let value = Follower::new(&self.model).value(output).with_context(|| self.path.display().to_string())?;
        let known = |element| if let Element::Known(number) = element { Some(number) } else { None };
        Ok(value.elements().into_iter().map(known).collect())
    }
}

/// Imports an ONNX file. An error names the file, and the node if known.
pub fn import(path: &Path, options: &ImportOptions) -> Result<Imported> {
    OnnxFile::read(path)?.import(options)
}

/// Imports a file's bytes as [`import`] does, with external tensors from `folder`.
pub fn import_bytes(bytes: Vec<u8>, folder: &Path, name: &str, options: &ImportOptions) -> Result<Imported> {
    import_model(&Model::parse(Bytes::from(bytes), folder)?, name, options)
}

/// Returns the files that hold weights of an ONNX file, by their paths from its folder. They need not exist.
///
/// # Errors
///
/// If the file cannot be read, or a path leaves its folder.
pub fn data_files(path: &Path) -> Result<Vec<PathBuf>> {
    let files = Model::read(path).and_then(|model| model.external_files());
    Ok(files.with_context(|| path.display().to_string())?.into_iter().collect())
}

/// Importer of ONNX files, without options.
#[derive(Clone, Copy, Debug)]
pub struct Onnx;

impl Importer for Onnx {
    fn accepts(&self, path: &Path) -> bool {
        path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("onnx"))
    }

    fn files(&self, path: &Path) -> Vec<PathBuf> {
        let external = data_files(path).unwrap_or_default().into_iter().map(|file| path.with_file_name(file));
        [path.to_owned()].into_iter().chain(external).collect()
    }

    fn load(&self, path: &Path) -> Result<Policy> {
        import(path, &ImportOptions::default())?.policy(path, path)
    }
}

impl Imported {
    /// Makes the policy. `file` is its name in errors, and `folder` becomes the policy's.
    ///
    /// # Errors
    ///
    /// As [`PolicySource::policy`].
    pub fn policy(&self, folder: &Path, file: &Path) -> Result<Policy> {
        let refused = self.refused.iter().map(|(name, why)| {
            let chosen = &self.output.0;
            format!("output {name:?} is named action, too, and is left out, as it cannot be imported: {why}. The policy is {chosen:?} alone")
        });
        let (guards, refused) = (self.guards.clone(), refused.collect());
        Ok(Policy { guards, refused, ports: self.described(), ..self.source.policy(folder, file)? })
    }

    /// Returns [`Self::ports`] and [`Self::cut`].
    pub fn described(&self) -> String {
        self.ports() + &self.cut()
    }

    /// Describes the observed inputs in order, the states and the action output, a line for each.
    pub fn ports(&self) -> String {
        let mut text = String::new();
        let mut at = 0;
        for (i, (name, len)) in self.inputs.iter().enumerate() {
            let head = if i == 0 { "input" } else { "" };
            let integers = if self.integers.contains(name) { ", integers" } else { "" };
            text += &format!("{head:9} obs[{at}:{}] = {name}{integers}\n", at + len);
            at += len;
        }
        let from_host: Vec<_> =
            self.prefix.inputs.iter().map(|(name, len)| format!("{name}, {}", count(*len, "value"))).collect();
        if !from_host.is_empty() {
            let order = "from a host; in recordings after the observation, as [token, head, element]";
            text += &format!("prefix    {}; {order}\n", from_host.join("; "));
        }
        if let Some(Denoiser { time, iterate, times, .. }) = &self.denoiser {
            let unscaled = "; actions as the network has them, since the sampler states no mean and std in \"action\"";
            let is_scaled =
                |action: &JsonContract| [&action.mean, &action.q01, &action.scale].into_iter().any(Option::is_some);
            let unscaled = if self.source.json.action.as_ref().is_some_and(is_scaled) { "" } else { unscaled };
            text += &format!(
                "sampler   {iterate} from noise in {}, at {time}{unscaled}\n",
                count(times.len(), "evaluation")
            );
        }
        for (from, to, len) in &self.states {
            text += &format!("state     {from} -> {to}, {}; kept by the policy, zero at reset\n", count(*len, "value"));
        }
        let chunk = self.source.json.chunk.map_or(String::new(), |chunk| format!(": a chunk of {chunk} actions"));
        text + &format!("output    {}, {}{chunk}\n", self.output.0, count(self.output.1, "value"))
    }

    /// Returns the values of the file's inputs for a row of the policy: those that it observes, those of the prefix, and the
    /// rest of the row.
    pub fn of_file(&self, row: &[f32]) -> Vec<f32> {
        let observed: usize = self.inputs.iter().map(|(_, len)| len).sum();
        let mut values = row.to_vec();
        for (i, at) in self.prefix.order.iter().enumerate() {
            values[observed + at] = row[observed + i];
        }
        values
    }

    /// Names the inputs and outputs that are left out, a line for each of the two.
    pub fn cut(&self) -> String {
        let cut = [
            ("inputs", &self.cut_inputs, "the action does not depend on them"),
            ("outputs", &self.cut_outputs, "only the action is kept"),
        ];
        let line =
            |(what, names, why): (&str, &Vec<String>, &str)| format!("cut       {what} {}: {why}\n", names.join(", "));
        cut.into_iter().filter(|(_, names, _)| !names.is_empty()).map(line).collect()
    }
}

/// Imports the network of a model; `name` becomes the policy's.
fn import_model(model: &Model, name: &str, options: &ImportOptions) -> Result<Imported> {
    options.check(&model.graph)?;
    let Followed { mut exprs, outputs, errors } = follow_outputs(model, options)?;
    let cells = Cells::find(model, &mut exprs, &outputs, &options.states)?;
    let refused = if options.output.is_none() { refused_actions(&errors) } else { Vec::new() };
    let output = &outputs[choose(&exprs, &cells, &outputs, errors, options)?];
    let is_constant = |i: &usize| matches!(output.value.elements()[*i], Element::Known(_));
    let constant = (0..output.value.len()).filter(is_constant).collect();
    let root = action_root(&mut exprs, &cells, output)?;
    let live = exprs.needed_instead(&[root], &cells.instead);
    refuse_integers(model, &exprs, &live)?;
    let pairs = cells.pairs(model, &exprs, &live, &outputs)?;
    let graph = Chosen { model, exprs: &exprs, cells: &cells, outputs: &outputs, action: &output.name };
    let values = exprs.len_of(root);
    let all_read = read_inputs(&exprs, &live);
    let of_prefix = prefix_inputs(model, &all_read, &options.prefix)?;
    let read: Vec<usize> = all_read.iter().copied().filter(|i| !of_prefix.contains(i)).collect();
    let places = match &options.sampler {
        Some(sampler) => Some(Places::find(model, &read, values, sampler)?),
        None => None,
    };
    // Its name may be the output's, as that of a state.
    let mut known = options.clone();
    known.observed.extend(places.map(|places| model.graph.inputs[places.iterate].name.clone()));
    let mut observed = observed_inputs(&graph, read.clone(), &pairs, &known)?;
    if let Some(places) = places {
        observed = places.order(&observed);
    }
    let mut observation = Observation::of(model, &exprs, &live, &observed);
    let slots = match places {
        Some(_) => observation.of_denoiser()?,
        None => vec![("obs", observation.len)],
    };
    let prefix = Observation::of(model, &exprs, &live, &of_prefix);
    let states = named_states(model, &pairs, &outputs);

    let (chunk, act_len) = if options.is_fed {
        (1, values)
    } else {
        refuse_batch(model, &observed, &output.value.shape)?;
        refuse_column(model, &observed, output)?;
        actions(&output.value.shape, values)?
    };
    if let Some(execute) = options.sampler.as_ref().and_then(|sampler| sampler.execute) {
        let shape = &output.value.shape;
        ensure!(
            execute <= chunk,
            "execute is {execute}, and an output of shape {shape:?} has {chunk}: a chunk is [1, actions, values]"
        );
    }
    // The last nodes of a denoiser are not those of its actions.
    let is_inner = options.is_inner || places.is_some();
    let (root, contract) = if is_inner { (root, None) } else { action::contract(&exprs, root, act_len) };
    let last = contract.iter().flat_map(keys).collect();
    let (contract, bounded) = match &options.sampler {
        Some(sampler) => (sampler.action.clone(), 0),
        None if is_inner => (None, 0),
        None => action::bounded(&exprs, root, contract, act_len),
    };
    let contract = match options.limits.is_empty() {
        true => contract,
        false => Some(contract.unwrap_or_default().limited(&options.limits, act_len)?),
    };
    let root = simplify(&mut exprs, root, &cells.instead);
    let offsets = Offsets { observed: &observation.offsets, prefix: &prefix.offsets };
    let lowered = lower(&exprs, root, offsets, slots).map_err(|(id, error)| at_node(model, &exprs, id, error))?;
    let is_read_once = lowered.prefix.iter().collect::<HashSet<_>>().len() == prefix.len;
    ensure!(
        is_read_once && lowered.prefix.len() == prefix.len,
        "attention reads {} of the {} values of the inputs of --prefix; it must read each once",
        lowered.prefix.len(),
        prefix.len
    );

    let is_chunk = chunk > 1 || places.is_some();
    let sampler = options.sampler.as_ref();
    let json = PolicyJson {
        name: printable(name).chars().take(50).collect(),
        kind: is_chunk.then(|| sampler.map_or("chunk", |sampler| &sampler.kind).to_owned()),
        chunk: is_chunk.then_some(chunk),
        execute: sampler.and_then(|sampler| sampler.execute),
        overlap: sampler.and_then(|sampler| sampler.overlap),
        obs_dim: observation.len,
        act_dim: act_len,
        control_hz: options.rate_hz,
        // Without a contract, the actions of a chunk would be limited to -1 .. 1.
        action: contract.or_else(|| is_chunk.then(JsonContract::default)),
        denoising: sampler.map(|sampler| sampler.steps.clone()).unwrap_or_default(),
        ops: lowered.ops,
        ..PolicyJson::default()
    };
    let mut about = vec![
        ("source", format!("ONNX by {}", model.producer).into()),
        ("inputs", serde_json::to_value(&observation.inputs)?),
    ];
    if !states.is_empty() {
        about.push(("states", serde_json::to_value(&states)?));
    }
    let next = pairs.iter().map(|&(_, next)| outputs[next].name.clone());
    let guards = remarks::guards(model, &exprs, &[output.name.clone()].into_iter().chain(next).collect::<Vec<_>>())?;
    let action = printable(&output.name).into_owned();
    Ok(Imported {
        ops: json.ops.iter().map(|op| op.op.clone()).collect(),
        source: PolicySource { json, about, tensors: lowered.tensors },
        producer: model.producer.clone(),
        cut_inputs: cut_inputs(model, &all_read, &states),
        prefix: Prefix { inputs: prefix.inputs, order: lowered.prefix },
        cut_outputs: cut_outputs(model, &action, &states),
        denoiser: places.zip(sampler).map(|(places, sampler)| places.named(model, sampler)).transpose()?,
        inputs: observation.inputs,
        integers: observation.integers,
        states,
        output: (action, values),
        constant,
        refused,
        nodes: model.graph.nodes.len(),
        contract: last,
        bounded,
        guards,
        unsized_axes: remarks::unsized_axes(model, &exprs, &live),
        faults: remarks::faults(model),
    })
}

/// The outputs of a graph as expressions.
struct Followed {
    exprs: Exprs,
    outputs: Vec<Output>,
    /// Outputs that cannot be converted, with the reason.
    errors: Vec<(String, Error)>,
}

/// Converts the graph's outputs, and the value that the caller chooses, to expressions.
fn follow_outputs(model: &Model, options: &ImportOptions) -> Result<Followed> {
    let mut follower = Follower::new(model);
    let mut outputs = Vec::new();
    let mut errors = Vec::new();
    for port in &model.graph.outputs {
        match follower.value(&port.name) {
            Ok(value) => match refuse_parts_of_attention(model, &follower.exprs, &value) {
                Ok(()) => outputs.push(Output { name: port.name.clone(), value }),
                Err(error) => errors.push((port.name.clone(), error)),
            },
            Err(error) => errors.push((port.name.clone(), error)),
        }
    }
    if let Some(inner) = &options.output
        && !outputs.iter().any(|output| output.name == *inner)
    {
        let value = follower.value(inner).with_context(|| format!("output {:?}", printable(inner)))?;
        outputs.push(Output { name: inner.clone(), value });
    }
    Ok(Followed { exprs: follower.exprs, outputs, errors })
}

/// Refuses a value that needs a product of values or a softmax, except within attention.
fn refuse_parts_of_attention(model: &Model, exprs: &Exprs, value: &Tensor) -> Result<()> {
    for id in needed(exprs, value.elements()) {
        let why = match exprs.get(id) {
            Expr::Products(_) => PRODUCT,
            Expr::Softmax(..) => SOFTMAX,
            _ => continue,
        };
        return Err(at_node(model, exprs, id, Error::input(why)));
    }
    Ok(())
}

/// Makes one expression of an output's elements. A constant element becomes another one times 0, plus an offset.
fn action_root(exprs: &mut Exprs, cells: &Cells, output: &Output) -> Result<Id> {
    let elements = Tensor::of_elements(output.value.shape.clone(), cells.elements(&output.value)).elements();
    let first = elements.iter().find_map(value).with_context(|| {
        format!("output {:?} depends on no input; choose another by --output NAME", printable(&output.name))
    })?;
    let open: Vec<(Id, usize)> = elements.iter().map(|element| value(element).unwrap_or(first)).collect();
    let affine = |element: &Element| if let Element::Known(number) = element { (0.0, *number) } else { (1.0, 0.0) };
    let (scale, offset) = elements.iter().map(affine).unzip();
    let root = exprs.vector(&open);
    Ok(exprs.affine(root, scale, offset))
}

/// Names the inputs without a default that are neither read nor states.
fn cut_inputs(model: &Model, read: &[usize], states: &[(String, String, usize)]) -> Vec<String> {
    let ports = model.graph.inputs.iter().enumerate();
    let given = ports.filter(|(i, port)| !read.contains(i) && !model.graph.initializers.contains_key(&port.name));
    let names = given.map(|(_, port)| printable(&port.name).into_owned());
    names.filter(|name| !states.iter().any(|(state, ..)| state == name)).collect()
}

/// Names the outputs that are neither the action nor the next values of states.
fn cut_outputs(model: &Model, action: &str, states: &[(String, String, usize)]) -> Vec<String> {
    let outputs = model.graph.outputs.iter().map(|port| printable(&port.name).into_owned());
    outputs.filter(|name| *name != action && !states.iter().any(|(_, next, _)| next == name)).collect()
}

fn keys(contract: &JsonContract) -> Vec<&'static str> {
    let all =
        [("scale", &contract.scale), ("offset", &contract.offset), ("low", &contract.low), ("high", &contract.high)];
    all.into_iter().filter(|(_, values)| values.is_some()).map(|(name, _)| name).collect()
}

fn at_node(model: &Model, exprs: &Exprs, id: Id, error: Error) -> Error {
    let at = exprs.origin(id);
    match model.graph.nodes.get(at) {
        Some(node) => error.context(format!("node {at} {:?} ({})", node.name, node.op)),
        None => error,
    }
}
