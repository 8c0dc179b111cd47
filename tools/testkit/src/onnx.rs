//! Small ONNX files for tests.

/// Returns a file whose output "action" is a linear function of its input "actor_obs".
pub fn linear(inputs: usize, outputs: usize, metadata: &[(&str, &str)]) -> Vec<u8> {
    let nodes = [("Gemm", &["actor_obs", "weight", "bias"][..], "action")];
    let tensors =
        [("weight", &[inputs, outputs][..], weights(inputs, outputs)), ("bias", &[outputs], vec![0.5; outputs])];
    graph(&nodes, &tensors, &[("actor_obs", inputs)], &[("action", outputs)], metadata)
}

/// Returns the weights of [`linear`], those of an input one after the other.
pub fn weights(inputs: usize, outputs: usize) -> Vec<f32> {
    (0..inputs * outputs).map(|i| 0.01 * (1 + i % 7) as f32).collect()
}

/// A node: operator, inputs, outputs, and attributes that are integers.
pub type Node<'a> = (&'a str, &'a [&'a str], &'a [&'a str], &'a [(&'a str, usize)]);

/// Returns a file with nodes (operator, inputs, output), tensors (name, shape, values), and inputs and outputs with
/// their lengths, whose shapes are `[1, length]`.
pub fn graph(
    nodes: &[(&str, &[&str], &str)],
    tensors: &[(&str, &[usize], Vec<f32>)],
    inputs: &[(&str, usize)],
    outputs: &[(&str, usize)],
    metadata: &[(&str, &str)],
) -> Vec<u8> {
    let gives: Vec<[&str; 1]> = nodes.iter().map(|(_, _, gives)| [*gives]).collect();
    let nodes: Vec<Node<'_>> = nodes
        .iter()
        .zip(&gives)
        .map(|((operator, reads, _), gives)| (*operator, *reads, &gives[..], &[][..]))
        .collect();
    let shapes = |ports: &[(&str, usize)]| ports.iter().map(|(_, len)| [1, *len]).collect::<Vec<_>>();
    let (of_inputs, of_outputs) = (shapes(inputs), shapes(outputs));
    let inputs: Vec<_> = inputs.iter().zip(&of_inputs).map(|((name, _), shape)| (*name, &shape[..])).collect();
    let outputs: Vec<_> = outputs.iter().zip(&of_outputs).map(|((name, _), shape)| (*name, &shape[..])).collect();
    shaped(&nodes, tensors, &inputs, &outputs, metadata)
}

/// Returns a file whose ports have any shapes.
pub fn shaped(
    nodes: &[Node<'_>],
    tensors: &[(&str, &[usize], Vec<f32>)],
    inputs: &[(&str, &[usize])],
    outputs: &[(&str, &[usize])],
    metadata: &[(&str, &str)],
) -> Vec<u8> {
    let mut graph = field(2, b"graph");
    for (operator, reads, gives, integers) in nodes {
        let of = |key: usize, names: &[&str]| names.iter().flat_map(|name| field(key, name.as_bytes())).collect();
        let (reads, gives): (Vec<u8>, Vec<u8>) = (of(1, reads), of(2, gives));
        let attribute = |(name, value): &(&str, usize)| {
            field(5, &[field(1, name.as_bytes()), number(3, *value), number(20, 2)].concat())
        };
        let node = [reads, gives, field(4, operator.as_bytes()), integers.iter().flat_map(attribute).collect()];
        graph.extend(field(1, &node.concat()));
    }
    graph.extend(tensors.iter().flat_map(|(name, shape, values)| field(5, &tensor(name, shape, values))));
    graph.extend(inputs.iter().flat_map(|(name, shape)| field(11, &port(name, shape))));
    graph.extend(outputs.iter().flat_map(|(name, shape)| field(12, &port(name, shape))));
    let opset = [field(1, b""), number(2, 13)];
    with_metadata([number(1, 8), field(7, &graph), field(8, &opset.concat())].concat(), metadata)
}

/// Appends metadata to a file.
pub fn with_metadata(mut model: Vec<u8>, metadata: &[(&str, &str)]) -> Vec<u8> {
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

fn port(name: &str, shape: &[usize]) -> Vec<u8> {
    let axes: Vec<u8> = shape.iter().flat_map(|axis| field(1, &number(1, *axis))).collect();
    let kind = field(1, &[number(1, 1), field(2, &axes)].concat());
    [field(1, name.as_bytes()), field(2, &kind)].concat()
}
