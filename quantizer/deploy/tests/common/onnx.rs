//! Small ONNX files for tests.

/// Returns a file whose output "action" is a linear function of its input "actor_obs".
pub(crate) fn linear(inputs: usize, outputs: usize, metadata: &[(&str, &str)]) -> Vec<u8> {
    let weights: Vec<f32> = (0..inputs * outputs).map(|i| 0.01 * (1 + i % 7) as f32).collect();
    let node = [field(1, b"actor_obs"), field(1, b"weight"), field(1, b"bias"), field(2, b"action"), field(4, b"Gemm")];
    let graph = [
        field(1, &node.concat()),
        field(2, b"graph"),
        field(5, &tensor("weight", &[inputs, outputs], &weights)),
        field(5, &tensor("bias", &[outputs], &vec![0.5; outputs])),
        field(11, &port("actor_obs", inputs)),
        field(12, &port("action", outputs)),
    ];
    let opset = [field(1, b""), number(2, 13)];
    let mut model = [number(1, 8), field(7, &graph.concat()), field(8, &opset.concat())].concat();
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
