//! The models of a pipeline and their ports.

use std::fs;

use actq::error::{Context as _, Result, ensure};
use actq::text::printable;
use sha2::{Digest as _, Sha256};

use crate::bundle::{Bundle, beside};
use crate::document::Document;
use crate::facts::Facts;
use crate::families::common::{check_names, counts};
use crate::yaml::Node;

/// Most models of a pipeline.
const MAX_MODELS: usize = 64;
/// Most values of a port; an image can address no more.
const MAX_VALUES: usize = u16::MAX as usize;
/// Stands for an axis of times in `element_names`.
const TIME: &str = "__temporal_axis__";

pub(super) struct Model {
    pub(super) name: String,
    pub(super) file: String,
    pub(super) inputs: Vec<Port>,
    pub(super) outputs: Vec<Port>,
    /// Its file and key.
    pub(super) at: String,
}

/// An input or an output of a model.
pub(super) struct Port {
    pub(super) name: String,
    /// Its name in the ONNX file.
    pub(super) graph: String,
    pub(super) shape: Vec<usize>,
    pub(super) len: usize,
    /// Its role; empty if none is given.
    pub(super) kind: String,
    pub(super) unit: String,
    /// Names of its values, if each has one.
    pub(super) names: Option<Vec<String>>,
    /// `true` if one of its axes is time.
    pub(super) is_series: bool,
    /// Its file and key, with the connection to Isaac Lab, if there is one.
    pub(super) at: String,
}

/// Reads the models, in the order in which they run.
pub(super) fn models(bundle: &Bundle, yaml: &Document) -> Result<Vec<Model>> {
    let names: Vec<String> = yaml.keys("models").into_iter().map(str::to_owned).collect();
    let at = yaml.location("models");
    ensure!((1..=MAX_MODELS).contains(&names.len()), "{at}: it has {} models; give 1 to {MAX_MODELS}", names.len());
    check_names(&names, &at)?;
    names.into_iter().map(|name| model(bundle, yaml, name)).collect()
}

fn model(bundle: &Bundle, yaml: &Document, name: String) -> Result<Model> {
    let path = format!("models.{name}");
    let file = network(bundle, yaml, &format!("{path}.parameters"))?;
    let signature = bundle.signature(&file)?;
    let ports = |what: &str, graph: &[(String, Option<usize>)]| -> Result<Vec<Port>> {
        let path = format!("{path}.{what}");
        let mut ports: Vec<Port> =
            yaml.keys(&path).iter().map(|i| port(yaml, &format!("{path}.{i}"))).collect::<Result<_>>()?;
        let names: Vec<String> = ports.iter().map(|port| port.name.clone()).collect();
        check_names(&names, &yaml.location(&path))?;
        bind(&mut ports, graph, what, &file, &yaml.location(&path))?;
        Ok(ports)
    };
    let (inputs, outputs) = (ports("inputs", &signature.inputs)?, ports("outputs", &signature.outputs)?);
    Ok(Model { at: yaml.location(&path), name, file, inputs, outputs })
}

/// Returns a model's ONNX file.
fn network(bundle: &Bundle, yaml: &Document, path: &str) -> Result<String> {
    let key = format!("{path}.backend");
    let backend = yaml.required(&key, "the name of a backend", Node::text)?;
    ensure!(
        backend == "onnx",
        "{} = {:?}: an image is made of ONNX files only; export the model with \
         annotate.output_tensors(..., export_with=\"onnx\"), or with --export_method onnx-dynamo of Isaac Lab's LEAPP export",
        yaml.location(&key),
        printable(backend)
    );
    let key = format!("{path}.model_path");
    let name = yaml.required(&key, "the path of a file", Node::text)?;
    let file = beside(&yaml.file, name.strip_prefix("./").unwrap_or(name));
    let full = bundle.path(&file).with_context(|| yaml.location(&key))?;
    ensure!(bundle.has(&file), "{}: there is no {:?} in the bundle", yaml.location(&key), printable(&file));
    let key = format!("{path}.sha256sum");
    if let Some(given) = yaml.optional(&key, "a hash in hexadecimal digits", Node::text)? {
        let bytes = fs::read(full).with_context(|| file.clone())?;
        let own: String = Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect();
        ensure!(
            given.eq_ignore_ascii_case(&own),
            "{}: {:?}, and {file} has {own}: the file has changed since its export; export it again",
            yaml.location(&key),
            printable(given)
        );
    }
    Ok(file)
}

fn port(yaml: &Document, path: &str) -> Result<Port> {
    let of = |key: &str| format!("{path}.{key}");
    let text = |key: &str| -> Result<String> {
        Ok(yaml.optional(&of(key), "a text", Node::text)?.unwrap_or_default().to_owned())
    };
    let name = yaml.required(&of("name"), "a name", Node::text)?.to_owned();
    let key = of("dtype");
    let dtype = yaml.required(&key, "a type of numbers", Node::text)?;
    ensure!(
        dtype == "float32",
        "{} = {:?}: the ports of an image are float32; cast outside of the pipeline and export again",
        yaml.location(&key),
        printable(dtype)
    );
    let lens = |node: &Node| counts(node).filter(|shape| !shape.contains(&0));
    let shape = yaml.required(&of("shape"), "a list of lengths above 0", lens)?;
    let len = shape.iter().try_fold(1, |len: usize, axis| len.checked_mul(*axis)).filter(|len| *len <= MAX_VALUES);
    let len = len.with_context(|| format!("{}: more than {MAX_VALUES} values", yaml.location(&of("shape"))))?;
    let (names, is_series) = names(yaml, path, &shape, len)?;
    let at = match yaml.optional(&of("isaaclab_connection"), "a text", Node::text)? {
        Some(connection) => format!("{} ({})", yaml.location(path), printable(connection)),
        None => yaml.location(path),
    };
    Ok(Port { graph: name.clone(), name, shape, len, kind: text("kind")?, unit: text("units")?, names, is_series, at })
}

/// Reads the names of a port's values, and whether an axis is time. Up to schema 1.3, `element_names` has them, and
/// from 1.4 on, `axes`.
fn names(yaml: &Document, path: &str, shape: &[usize], len: usize) -> Result<(Option<Vec<String>>, bool)> {
    let mut lists: Vec<Vec<String>> = Vec::new();
    let mut is_series = false;
    let axes = format!("{path}.axes");
    for axis in yaml.keys(&axes) {
        let kind = yaml.optional(&format!("{axes}.{axis}.kind"), "a text", Node::text)?;
        is_series |= kind == Some("time");
        lists.extend(yaml.optional(&format!("{axes}.{axis}.names"), "a list of names", Node::texts)?);
    }
    let key = format!("{path}.element_names");
    if let Some(node) = yaml.node(&key) {
        let is_name = |item: &Node| item.text().is_some_and(|text| text != TIME) && !item.is_null();
        if node.items().iter().all(is_name) {
            lists.push(yaml.texts(&key)?);
        } else {
            for item in node.items().iter().filter(|item| !item.is_null()) {
                match item.texts() {
                    Some(list) => lists.push(list),
                    None => {
                        let is_time = item.text() == Some(TIME);
                        ensure!(is_time, "{} (line {}) must be lists of names", yaml.location(&key), item.line);
                        is_series = true;
                    }
                }
            }
        }
    }
    let key = if yaml.peek(&axes).is_some() { axes } else { key };
    if let Some(list) = lists.iter().find(|list| !shape.contains(&list.len())) {
        return Err(Facts::contradiction(
            "length of an axis",
            (&yaml.location(&key), &format!("{} names", list.len())),
            (&yaml.location(&format!("{path}.shape")), &format!("{shape:?}")),
        ));
    }
    let named = lists.iter().try_fold(1, |product: usize, list| product.checked_mul(list.len()));
    if lists.is_empty() || named != Some(len) {
        return Ok((None, is_series));
    }
    let names = lists.iter().filter(|list| list.len() > 1).fold(Vec::new(), |outer: Vec<String>, inner| {
        if outer.is_empty() {
            return inner.clone();
        }
        outer.iter().flat_map(|outer| inner.iter().map(move |inner| format!("{outer}_{inner}"))).collect()
    });
    let names = if names.is_empty() { lists.pop().unwrap_or_default() } else { names };
    check_names(&names, &yaml.location(&key))?;
    Ok((Some(names), is_series))
}

/// Finds the ports in the ONNX file by their places, as LEAPP's runtime passes values.
fn bind(ports: &mut [Port], graph: &[(String, Option<usize>)], what: &str, file: &str, at: &str) -> Result<()> {
    let contradiction = |what: &str, own: &str, other: &str| Err(Facts::contradiction(what, (at, own), (file, other)));
    if ports.len() != graph.len() {
        let names: Vec<_> = graph.iter().map(|(name, _)| printable(name)).collect();
        let of_file = format!("{}: {}", graph.len(), names.join(", "));
        return contradiction(&format!("number of {what}"), &ports.len().to_string(), &of_file);
    }
    for (i, (port, (name, len))) in ports.iter_mut().zip(graph).enumerate() {
        let elsewhere = graph.iter().position(|(name, _)| *name == port.name).filter(|other| *other != i);
        if let Some(other) = elsewhere {
            let own = format!("that {:?} is number {i}", printable(&port.name));
            return contradiction(&format!("order of {what}"), &own, &format!("that it is number {other}"));
        }
        if let Some(len) = len.filter(|len| *len > 1 && *len != port.len) {
            let what = format!("length of {:?}", printable(&port.name));
            return contradiction(&what, &format!("{} values", port.len), &format!("{len} values"));
        }
        port.graph.clone_from(name);
    }
    Ok(())
}
