//! A graph as the bytes of an ONNX file.

use prost::Message;
use prost::bytes::Bytes;

use super::builder::{Attribute, Data, Network, Node, Tensor};
use crate::file::proto;

/// Version of the format, and operator set of the nodes.
const IR_VERSION: i64 = 8;
const OPERATOR_SET: i64 = 17;
/// Numbers of element types in `TensorProto.DataType`.
const FLOAT: i32 = 1;
const INT64: i32 = 7;
/// Numbers of types in `AttributeProto.AttributeType`.
const OF_FLOAT: i32 = 1;
const OF_INT: i32 = 2;
const OF_INTS: i32 = 7;
/// Name of the axis of samples.
const BATCH: &str = "batch";

/// Returns the file of a network called `name`.
pub fn file(network: &Network, name: &str) -> Vec<u8> {
    let inputs = network.inputs.iter().map(|(name, len)| port(name, &[*len]));
    let graph = proto::Graph {
        node: network.nodes.iter().map(node).collect(),
        name: Some(name.to_owned()),
        initializer: network.tensors.iter().map(tensor).collect(),
        input: inputs.collect(),
        output: network.outputs.iter().map(|(name, shape)| port(name, shape)).collect(),
    };
    let model = proto::Model {
        ir_version: Some(IR_VERSION),
        producer_name: Some("actq".to_owned()),
        producer_version: Some(env!("CARGO_PKG_VERSION").to_owned()),
        graph: Some(bytes(&graph)),
        opset_import: vec![bytes(&proto::OperatorSet { domain: None, version: Some(OPERATOR_SET) })],
        ..Default::default()
    };
    model.encode_to_vec()
}

fn bytes(message: &impl Message) -> Bytes {
    message.encode_to_vec().into()
}

fn port(name: &str, shape: &[usize]) -> Bytes {
    let batch = proto::Dimension { dim_param: Some(BATCH.to_owned()), ..Default::default() };
    let axes = shape.iter().map(|len| proto::Dimension { dim_value: Some(*len as i64), ..Default::default() });
    let shape = proto::Shape { dim: [batch].into_iter().chain(axes).map(|dimension| bytes(&dimension)).collect() };
    let tensor_type = proto::TensorType { elem_type: Some(FLOAT), shape: Some(shape) };
    let kind = proto::Type { tensor_type: Some(tensor_type) };
    bytes(&proto::ValueInfo { name: Some(name.to_owned()), r#type: Some(kind) })
}

fn node(node: &Node) -> Bytes {
    bytes(&proto::Node {
        input: node.inputs.clone(),
        output: vec![node.output.clone()],
        // Names, by which tools tell nodes apart when they join them.
        name: Some(node.output.clone()),
        op_type: Some(node.op.to_owned()),
        attribute: node.attributes.iter().map(|(name, value)| attribute(name, value)).collect(),
        ..Default::default()
    })
}

fn attribute(name: &str, value: &Attribute) -> Bytes {
    let name = Some(name.to_owned());
    bytes(&match value {
        Attribute::Int(i) => proto::Attribute { name, i: Some(*i), r#type: Some(OF_INT), ..Default::default() },
        Attribute::Ints(ints) => {
            proto::Attribute { name, ints: ints.clone(), r#type: Some(OF_INTS), ..Default::default() }
        }
        Attribute::Float(f) => proto::Attribute { name, f: Some(*f), r#type: Some(OF_FLOAT), ..Default::default() },
    })
}

fn tensor(tensor: &Tensor) -> Bytes {
    let (data_type, raw) = match &tensor.data {
        Data::Floats(values) => (FLOAT, values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>()),
        Data::Integers(values) => (INT64, values.iter().flat_map(|v| v.to_le_bytes()).collect()),
    };
    bytes(&proto::Tensor {
        dims: tensor.shape.iter().map(|len| *len as i64).collect(),
        data_type: Some(data_type),
        name: Some(tensor.name.clone()),
        raw_data: Some(raw.into()),
        ..Default::default()
    })
}
