//! Small ONNX files for tests.
#![allow(dead_code, reason = "each test uses some of it")]

/// Returns a file whose output "action" is a linear function of its input "actor_obs".
pub(crate) fn linear(inputs: usize, outputs: usize, metadata: &[(&str, &str)]) -> Vec<u8> {
    let nodes = [("Gemm", &["actor_obs", "weight", "bias"][..], "action")];
    let tensors =
        [("weight", &[inputs, outputs][..], weights(inputs, outputs)), ("bias", &[outputs], vec![0.5; outputs])];
    graph(&nodes, &tensors, &[("actor_obs", inputs)], &[("action", outputs)], metadata)
}

/// Returns the weights of [`linear`], those of an input one after the other.
pub(crate) fn weights(inputs: usize, outputs: usize) -> Vec<f32> {
    (0..inputs * outputs).map(|i| 0.01 * (1 + i % 7) as f32).collect()
}

/// Returns a file with nodes (operator, inputs, output), tensors (name, shape, values), and inputs and outputs with
/// their lengths.
pub(crate) fn graph(
    nodes: &[(&str, &[&str], &str)],
    tensors: &[(&str, &[usize], Vec<f32>)],
    inputs: &[(&str, usize)],
    outputs: &[(&str, usize)],
    metadata: &[(&str, &str)],
) -> Vec<u8> {
    let mut graph = field(2, b"graph");
    for (operator, reads, gives) in nodes {
        let reads: Vec<u8> = reads.iter().flat_map(|name| field(1, name.as_bytes())).collect();
        let node = [reads, field(2, gives.as_bytes()), field(4, operator.as_bytes())];
        graph.extend(field(1, &node.concat()));
    }
    graph.extend(tensors.iter().flat_map(|(name, shape, values)| field(5, &tensor(name, shape, values))));
    graph.extend(inputs.iter().flat_map(|(name, len)| field(11, &port(name, *len))));
    graph.extend(outputs.iter().flat_map(|(name, len)| field(12, &port(name, *len))));
    let opset = [field(1, b""), number(2, 13)];
    let mut model = [number(1, 8), field(7, &graph), field(8, &opset.concat())].concat();
    for (key, value) in metadata {
        model.extend(field(14, &[field(1, key.as_bytes()), field(2, value.as_bytes())].concat()));
    }
    model
}

fn varint(mut number: usize) -> Vec<u8> {
    let mut bytes = Vec::new();
    while number > 127 {
        bytes.push((number & 127) as u8 | 128);
        number >>= 7;
    }
    bytes.push(number as u8);
    bytes
}

fn number(key: usize, value: usize) -> Vec<u8> {
    [varint(key << 3), varint(value)].concat()
}

fn field(key: usize, bytes: &[u8]) -> Vec<u8> {
    [varint(key << 3 | 2), varint(bytes.len()), bytes.to_vec()].concat()
}

fn tensor(name: &str, shape: &[usize], values: &[f32]) -> Vec<u8> {
    let shape: Vec<u8> = shape.iter().flat_map(|axis| number(1, *axis)).collect();
    let values: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
    [shape, number(2, 1), field(8, name.as_bytes()), field(9, &values)].concat()
}

fn port(name: &str, len: usize) -> Vec<u8> {
    let axes: Vec<u8> = [1, len].iter().flat_map(|axis| field(1, &number(1, *axis))).collect();
    let kind = field(1, &[number(1, 1), field(2, &axes)].concat());
    [field(1, name.as_bytes()), field(2, &kind)].concat()
}
