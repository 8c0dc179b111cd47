//! ONNX files for tests, as exporters write them.

use actq_onnx::proto;
use actq_testkit::Random;
use prost::Message as _;
use prost::bytes::Bytes;

/// A graph under construction. Values have names.
#[derive(Clone, Default)]
pub(super) struct File {
    graph: proto::Graph,
    weights: u64,
}

/// An attribute's value.
#[derive(Clone)]
pub(super) enum Value {
    Int(i64),
    Ints(Vec<i64>),
    Real(f32),
    Text(String),
}

pub(super) fn tensor(name: &str, dims: &[usize], data: &[f32]) -> proto::Tensor {
    proto::Tensor {
        dims: dims.iter().map(|&n| n as i64).collect(),
        data_type: Some(1),
        raw_data: Some(data.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>().into()),
        name: Some(name.to_owned()),
        ..Default::default()
    }
}

/// A tensor whose data is in another file, with the keys of the place.
pub(super) fn external(dims: &[usize], place: &[(&str, &str)]) -> proto::Tensor {
    let entry = |(key, value): &(&str, &str)| {
        encoded(&proto::Entry { key: Some((*key).to_owned()), value: Some((*value).to_owned()) })
    };
    let external_data = place.iter().map(entry).collect();
    proto::Tensor { raw_data: None, external_data, data_location: Some(1), ..tensor("w", dims, &[]) }
}

pub(super) fn encoded(message: &impl prost::Message) -> Bytes {
    message.encode_to_vec().into()
}

/// ONNX's types of inputs and outputs.
const FLOAT: i32 = 1;
const INT64: i32 = 7;

fn port(name: &str, kind: i32, dims: &[i64]) -> Bytes {
    let axis = |&n: &i64| match n {
        0.. => proto::Dimension { dim_value: Some(n), dim_param: None },
        _ => proto::Dimension { dim_value: None, dim_param: Some("batch".to_owned()) },
    };
    let shape = proto::Shape { dim: dims.iter().map(|n| encoded(&axis(n))).collect() };
    let tensor_type = Some(proto::TensorType { elem_type: Some(kind), shape: Some(shape) });
    encoded(&proto::ValueInfo { name: Some(name.to_owned()), r#type: Some(proto::Type { tensor_type }) })
}

impl File {
    /// Adds an input; -1 is a dynamic axis.
    pub(super) fn input(&mut self, name: &str, dims: &[i64]) {
        self.graph.input.push(port(name, FLOAT, dims));
    }

    /// Adds an input of integers.
    pub(super) fn integers(&mut self, name: &str, dims: &[i64]) {
        self.graph.input.push(port(name, INT64, dims));
    }

    pub(super) fn output(&mut self, name: &str, dims: &[i64]) {
        self.graph.output.push(port(name, FLOAT, dims));
    }

    pub(super) fn initializer(&mut self, tensor: &proto::Tensor) {
        self.graph.initializer.push(encoded(tensor));
    }

    /// Adds a weight of these values.
    pub(super) fn reals(&mut self, dims: &[usize], data: &[f32]) -> String {
        self.weights += 1;
        let name = format!("w{}", self.weights);
        self.initializer(&tensor(&name, dims, data));
        name
    }

    /// Adds a weight of random values, small enough for sums to stay about 1.
    pub(super) fn drawn(&mut self, dims: &[usize]) -> String {
        let n: usize = dims.iter().product();
        let scale = if dims.len() > 1 { 1.5 / (dims.iter().max().map_or(1.0, |&n| n as f32)).sqrt() } else { 0.5 };
        let mut random = Random::new(self.weights);
        let data: Vec<f32> = (0..n).map(|_| scale * random.unit()).collect();
        self.reals(dims, &data)
    }

    /// Adds a weight of integers.
    pub(super) fn ints(&mut self, data: &[i64]) -> String {
        self.weights += 1;
        let name = format!("w{}", self.weights);
        let tensor = proto::Tensor {
            dims: vec![data.len() as i64],
            data_type: Some(7),
            int64_data: data.to_vec(),
            name: Some(name.clone()),
            ..Default::default()
        };
        self.initializer(&tensor);
        name
    }

    /// Adds a node with one output, and returns the output's name.
    pub(super) fn node(&mut self, op: &str, inputs: &[&str], attributes: &[(&str, Value)]) -> String {
        let name = self.fresh(op);
        self.nodes(op, inputs, &[&name], attributes);
        name
    }

    /// Returns a new name for the output of the next node.
    pub(super) fn fresh(&self, op: &str) -> String {
        format!("{}_{}", op.to_lowercase(), self.graph.node.len())
    }

    /// Adds a node with these outputs.
    pub(super) fn nodes(&mut self, op: &str, inputs: &[&str], outputs: &[&str], attributes: &[(&str, Value)]) {
        let attribute = |(name, value): &(&str, Value)| {
            let name = Some((*name).to_owned());
            encoded(&match value.clone() {
                Value::Int(i) => proto::Attribute { name, i: Some(i), ..Default::default() },
                Value::Ints(ints) => proto::Attribute { name, ints, ..Default::default() },
                Value::Real(f) => proto::Attribute { name, f: Some(f), ..Default::default() },
                Value::Text(s) => proto::Attribute { name, s: Some(s.into()), ..Default::default() },
            })
        };
        // Readers other than ours need the type beside the value.
        let typed = |(attribute, value): (Bytes, &Value)| {
            let number: u8 = match value {
                Value::Real(_) => 1,
                Value::Int(_) => 2,
                Value::Text(_) => 3,
                Value::Ints(_) => 7,
            };
            // Field 20, a varint.
            [&attribute[..], &[0xa0, 0x01, number]].concat().into()
        };
        let list = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
        self.graph.node.push(encoded(&proto::Node {
            input: list(inputs),
            output: list(outputs),
            name: Some(format!("/node/{}", self.graph.node.len())),
            op_type: Some(op.to_owned()),
            attribute: attributes.iter().map(|a| (attribute(a), &a.1)).map(typed).collect(),
            ..Default::default()
        }));
    }

    /// Adds a call of an overload of the function `local.Act`.
    pub(super) fn call(&mut self, overload: &str, x: &str) -> String {
        let name = format!("act_{}", self.graph.node.len());
        self.graph.node.push(encoded(&proto::Node {
            input: vec![x.to_owned()],
            output: vec![name.clone()],
            op_type: Some("Act".to_owned()),
            domain: Some("local".to_owned()),
            overload: Some(overload.to_owned()),
            ..Default::default()
        }));
        name
    }

    /// Adds `x W + b` as Gemm with weights [out, in].
    pub(super) fn gemm(&mut self, x: &str, rows: usize, cols: usize) -> String {
        let (w, b) = (self.drawn(&[rows, cols]), self.drawn(&[rows]));
        self.node(
            "Gemm",
            &[x, &w, &b],
            &[("transB", Value::Int(1)), ("alpha", Value::Real(1.0)), ("beta", Value::Real(1.0))],
        )
    }

    /// Encodes the file.
    pub(super) fn bytes(&self) -> Vec<u8> {
        self.model().encode_to_vec()
    }

    pub(super) fn model(&self) -> proto::Model {
        let opset = proto::OperatorSet { domain: Some(String::new()), version: Some(17) };
        proto::Model {
            ir_version: Some(8),
            producer_name: Some("test".to_owned()),
            graph: Some(encoded(&proto::Graph { name: Some("g".to_owned()), ..self.graph.clone() })),
            opset_import: vec![encoded(&opset)],
            ..Default::default()
        }
    }
}
