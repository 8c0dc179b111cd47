//! The graph of a network, built from operations on an arena: each word knows which value it holds.

use actq::error::{Context as _, Result};
use actq_kernels::image::Region;

/// A graph. Values have the shape [batch, length]; a name is given once.
#[derive(Clone, Debug, Default)]
pub struct Network {
    /// Inputs with their lengths: `obs`, and if the network has them `state` and `noise`.
    pub inputs: Vec<(String, usize)>,
    /// Outputs with the lengths of their axes after the batch: `action`, and `next_state` if there is a state.
    pub outputs: Vec<(String, Vec<usize>)>,
    /// Constants.
    pub tensors: Vec<Tensor>,
    /// Grids of the weights among them; not part of ONNX.
    pub grids: Vec<Grid>,
    /// Nodes in order.
    pub nodes: Vec<Node>,
}

/// A constant.
#[derive(Clone, Debug)]
pub struct Tensor {
    /// Its name.
    pub name: String,
    /// Length of each axis.
    pub shape: Vec<usize>,
    /// The elements, row-major.
    pub data: Data,
}

/// The grid of a matrix in the image: each weight is a level times the step of its row and group.
#[derive(Clone, Debug)]
pub struct Grid {
    /// Name of the tensor with the weights [row, column].
    pub weights: String,
    /// Steps [row, group]; 0 for rows that the image does not have.
    pub steps: Vec<f32>,
    /// Columns of a group; all of them without group scales.
    pub group: usize,
    /// Bits of each row's levels; 0 for rows that the image does not have.
    pub bits: Vec<u32>,
}

/// Elements of a constant.
#[derive(Clone, Debug)]
pub enum Data {
    /// Numbers of the network.
    Floats(Vec<f32>),
    /// Places and lengths.
    Integers(Vec<i64>),
}

/// A node with one output.
#[derive(Clone, Debug)]
pub struct Node {
    /// Operator of ONNX.
    pub op: &'static str,
    /// Names of its inputs; an empty name is an input that is not given.
    pub inputs: Vec<String>,
    /// Name of its output.
    pub output: String,
    /// Attributes.
    pub attributes: Vec<(&'static str, Attribute)>,
    /// Of a matrix product, the magnitude to which the image rounds its input; not part of ONNX.
    pub x_max: Option<u16>,
}

/// A value of an attribute.
#[derive(Clone, Debug)]
pub enum Attribute {
    /// An integer.
    Int(i64),
    /// Integers.
    Ints(Vec<i64>),
    /// A number.
    Float(f32),
}

/// A value of the graph: its name and length.
#[derive(Clone, Debug)]
pub(super) struct Value {
    pub(super) name: String,
    pub(super) len: usize,
}

/// A graph, and the place of its values in the arena.
pub(super) struct Builder {
    pub(super) network: Network,
    values: Vec<Value>,
    /// For each word of the arena its value, and the index in it.
    words: Vec<Option<(usize, usize)>>,
}

impl Builder {
    pub(super) fn new(words: usize) -> Self {
        Self { network: Network::default(), values: Vec::new(), words: vec![None; words] }
    }

    /// Adds an input that the region holds at first.
    pub(super) fn input(&mut self, name: &str, region: Region) {
        self.network.inputs.push((name.to_owned(), region.len));
        self.write(region, Value { name: name.to_owned(), len: region.len });
    }

    /// Adds a node, and returns its output of `len` values.
    pub(super) fn node(
        &mut self,
        op: &'static str,
        inputs: &[&str],
        attributes: Vec<(&'static str, Attribute)>,
        len: usize,
    ) -> Value {
        let output = format!("v{}", self.network.nodes.len());
        let inputs = inputs.iter().map(|name| (*name).to_owned()).collect();
        self.network.nodes.push(Node { op, inputs, output: output.clone(), attributes, x_max: None });
        Value { name: output, len }
    }

    /// Adds an operator on values of one length.
    pub(super) fn apply(&mut self, op: &'static str, values: &[&Value]) -> Value {
        let names: Vec<&str> = values.iter().map(|value| &*value.name).collect();
        self.node(op, &names, Vec::new(), values.first().map_or(0, |value| value.len))
    }

    /// Adds a constant, unless one has this name already.
    pub(super) fn tensor(&mut self, name: String, shape: Vec<usize>, data: Data) -> String {
        if !self.network.tensors.iter().any(|tensor| tensor.name == name) {
            self.network.tensors.push(Tensor { name: name.clone(), shape, data });
        }
        name
    }

    /// Adds a constant vector of `len` values.
    pub(super) fn vector(&mut self, name: String, values: Vec<f32>) -> Value {
        let len = values.len();
        Value { name: self.tensor(name, vec![len], Data::Floats(values)), len }
    }

    pub(super) fn number(&mut self, number: f32) -> Value {
        let name = format!("number_{:08x}", number.to_bits());
        Value { name: self.tensor(name, Vec::new(), Data::Floats(vec![number])), len: 1 }
    }

    pub(super) fn integers(&mut self, integers: &[i64]) -> String {
        let words: Vec<String> = integers.iter().map(i64::to_string).collect();
        let name = format!("integers_{}", words.join("_").replace('-', "m"));
        self.tensor(name, vec![integers.len()], Data::Integers(integers.to_vec()))
    }

    /// Adds a part of a value.
    pub(super) fn slice(&mut self, value: &Value, from: usize, len: usize) -> Value {
        let [start, end] = [from, from + len].map(|at| self.integers(&[at as i64]));
        let axis = self.integers(&[1]);
        self.node("Slice", &[&value.name, &start, &end, &axis], Vec::new(), len)
    }

    /// Repeats a constant vector for each sample of the batch.
    pub(super) fn repeated(&mut self, vector: &Value) -> Value {
        let obs = self.network.inputs.first().map_or(String::new(), |(name, _)| name.clone());
        let (zero, one, len) = (self.integers(&[0]), self.integers(&[1]), self.integers(&[vector.len as i64]));
        let shape = self.node("Shape", &[&obs], Vec::new(), 2);
        let batch = self.node("Slice", &[&shape.name, &zero, &one, &zero], Vec::new(), 1);
        let axis = vec![("axis", Attribute::Int(0))];
        let shape = self.node("Concat", &[&batch.name, &len], axis, 2);
        self.node("Expand", &[&vector.name, &shape.name], Vec::new(), vector.len)
    }

    /// Puts a value into a region of its length.
    pub(super) fn write(&mut self, region: Region, value: Value) {
        let id = self.values.len();
        self.values.push(value);
        for (at, word) in self.words.iter_mut().skip(region.offset).take(region.len).enumerate() {
            *word = Some((id, at));
        }
    }

    /// Returns the content of a region.
    ///
    /// # Errors
    ///
    /// If nothing was written there, which a checked image excludes.
    pub(super) fn read(&mut self, region: Region) -> Result<Value> {
        let mut runs: Vec<(usize, usize, usize)> = Vec::new();
        for word in region.range() {
            let (id, at) = self.words.get(word).copied().flatten().context("an operation reads an unwritten word")?;
            match runs.last_mut() {
                Some((last, from, len)) if *last == id && *from + *len == at => *len += 1,
                _ => runs.push((id, at, 1)),
            }
        }
        let mut parts = Vec::new();
        for (id, from, len) in runs {
            let value = self.values[id].clone();
            parts.push(if len == value.len { value } else { self.slice(&value, from, len) });
        }
        if let [one] = &parts[..] {
            return Ok(one.clone());
        }
        let names: Vec<&str> = parts.iter().map(|part| &*part.name).collect();
        Ok(self.node("Concat", &names, vec![("axis", Attribute::Int(1))], region.len))
    }
}
