//! Malicious and damaged files: the importer refuses each with its fault, and none ends the process or fills the
//! memory.

use actq_onnx::{Choice, import_bytes, proto};
use anyhow::Result;
use proptest::prelude::*;
use tempfile::TempDir;

use super::file::{File, Value, encoded, tensor};

fn refused(bytes: Vec<u8>, expected: &str) {
    let dir = TempDir::new().expect("a folder");
    let error = import_bytes(bytes, dir.path(), "test", &Choice::default()).expect_err(expected);
    let error = format!("{error:#}");
    assert!(error.contains(expected), "{error} instead of {expected}");
}

fn with(build: impl FnOnce(&mut File)) -> Vec<u8> {
    let mut file = File::default();
    file.input("obs", &[1, 4]);
    build(&mut file);
    file.output("actions", &[1, 4]);
    file.bytes()
}

fn whole() -> Vec<u8> {
    with(|file| {
        let x = file.gemm("obs", 6, 4);
        let x = file.node("Elu", &[&x], &[]);
        let y = file.gemm(&x, 4, 6);
        file.nodes("Tanh", &[&y], &["actions"], &[]);
    })
}

/// One node between the observation and the action.
fn node(op: &str, more: &[&str], attributes: &[(&str, Value)]) -> Vec<u8> {
    with(|file| file.nodes(op, &[&["obs"], more].concat(), &["actions"], attributes))
}

fn external(location: &str) -> Vec<u8> {
    with(|file| {
        let entry = proto::Entry { key: Some("location".to_owned()), value: Some(location.to_owned()) };
        file.initializer(&proto::Tensor {
            raw_data: None,
            external_data: vec![encoded(&entry)],
            data_location: Some(1),
            ..tensor("w", &[4, 4], &[0.0; 16])
        });
        file.nodes("MatMul", &["obs", "w"], &["actions"], &[]);
    })
}

#[test]
fn each_malformed_file_is_refused_with_its_fault() {
    refused(Vec::new(), "the file is empty");
    refused(b"not an onnx file".to_vec(), "the file is not ONNX");
    let bytes = whole();
    refused(bytes[..bytes.len() / 2].to_vec(), "the file is damaged or truncated");
    let vast = |dims: &[usize]| {
        let dims = dims.to_vec();
        with(move |file| {
            file.initializer(&proto::Tensor { raw_data: None, ..tensor("w", &dims, &[]) });
            file.nodes("MatMul", &["obs", "w"], &["actions"], &[]);
        })
    };
    refused(vast(&[4, 1 << 40]), "exceeds the limit of a tensor's elements");
    refused(vast(&[4, 1 << 20]), "needs 4194304 values, and 0 are present");
    let norm = |epsilon: f32| {
        with(|file| {
            let ones = file.reals(&[4], &[1.0; 4]);
            let more = [("axis", Value::Int(-1)), ("epsilon", Value::Real(epsilon))];
            file.nodes("LayerNormalization", &["obs", &ones], &["actions"], &more);
        })
    };
    refused(norm(-0.5), "epsilon is -0.5");
    refused(norm(0.0), "it must be above 0");
    let huge = with(|file| {
        let shape = file.ints(&[1 << 13, 1 << 13]);
        let x = file.node("ConstantOfShape", &[&shape], &[]);
        file.nodes("MatMul", &["obs", &x], &["actions"], &[]);
    });
    refused(huge, "more values than a policy of this size can have");
    let doubled = with(|file| {
        let mut x = "obs".to_owned();
        for _ in 0..40 {
            x = file.node("Concat", &[&x, &x], &[("axis", Value::Int(1))]);
        }
        file.nodes("Identity", &[&x], &["actions"], &[]);
    });
    refused(doubled, "gives more values than a policy of this size can have");
    // Either side of the padding alone.
    let padded = with(|file| {
        let pads = file.ints(&[0, 600_000, 0, 600_000]);
        let x = file.node("Pad", &["obs", &pads], &[]);
        let pads = file.ints(&[2, 0, 2, 0]);
        file.nodes("Pad", &[&x, &pads], &["actions"], &[]);
    });
    refused(padded, "(Pad): shape [5, 1200004] has more values than a policy of this size can have");
    refused(external("../secret"), "outside the model's folder");
    refused(external("/etc/passwd"), "outside the model's folder");
    refused(external("weights.bin"), "cannot read \"weights.bin\", which holds the elements; put it beside the model");
    let cycle = with(|file| {
        file.nodes("Add", &["obs", "b"], &["a"], &[]);
        file.nodes("Tanh", &["a"], &["b"], &[]);
        file.nodes("Tanh", &["b"], &["actions"], &[]);
    });
    refused(cycle, "node 0 \"/node/0\" (Add): reads \"b\" before a node gives it; remove the cycle");
    refused(node("Add", &["nowhere"], &[]), "reads \"nowhere\" before a node gives it");
    refused(node("MaxPool", &["obs"], &[]), "node 0 \"/node/0\" (MaxPool): its kernel does not fit the shape [1, 4]");
    refused(node("ConvTranspose", &["obs"], &[]), "(ConvTranspose): has no kernel here; export the part after");
    refused(node("MatMul", &["obs"], &[]), "multiplies two values of the network, as attention does");
    refused(node("Softmax", &[], &[]), "(Softmax): has no kernel here");
    refused(node("Sqrt", &[], &[]), "node 0 \"/node/0\" (Sqrt): a square root has a kernel only within a norm");
    refused(
        node("Frobnicate", &[], &[]),
        "(Frobnicate): is not a supported operator; docs/IMPORT.md lists the supported operators",
    );
    refused(node("Cast", &[], &[("to", Value::Int(10))]), "rounds a value of the network to float16");
    refused(
        node("Clip", &[], &[("min", Value::Real(2.0)), ("max", Value::Real(1.0))]),
        "limits to 2 .. 1; the lower limit exceeds the upper one",
    );
    let not_finite = with(|file| {
        let w = file.reals(&[4, 4], &[f32::NAN; 16]);
        file.nodes("MatMul", &["obs", &w], &["actions"], &[]);
    });
    refused(not_finite, "holds a value that is not finite");
    let divided = with(|file| {
        let w = file.reals(&[4], &[0.0; 4]);
        file.nodes("Div", &["obs", &w], &["actions"], &[]);
    });
    refused(divided, "(Div): has a constant that is not finite, or divides by 0");
    let nested = (0..64).fold(proto::Graph::default(), |inner, _| {
        let g =
            proto::Attribute { name: Some("then_branch".to_owned()), g: Some(encoded(&inner)), ..Default::default() };
        let node = proto::Node {
            op_type: Some("If".to_owned()),
            output: vec!["actions".to_owned()],
            attribute: vec![encoded(&g)],
            ..Default::default()
        };
        let output = proto::ValueInfo { name: Some("actions".to_owned()), r#type: None };
        proto::Graph { node: vec![encoded(&node)], output: vec![encoded(&output)], ..Default::default() }
    });
    refused(
        encoded(&proto::Model { graph: Some(encoded(&nested)), ..File::default().model() }).to_vec(),
        "graphs are nested",
    );
    let forgets = with(|file| {
        let (w, r) = (file.drawn(&[1, 16, 4]), file.drawn(&[1, 16, 4]));
        let axes = file.ints(&[0]);
        let x = file.node("Unsqueeze", &["obs", &axes], &[]);
        file.nodes("LSTM", &[&x, &w, &r], &["actions"], &[("hidden_size", Value::Int(4))]);
    });
    refused(forgets, "state hidden is not carried to the next step; export it as an input of the graph");
    let reset = with(|file| {
        file.nodes("GRU", &["obs", "obs", "obs"], &["actions"], &[("hidden_size", Value::Int(4))]);
    });
    refused(reset, "computes the reset gate before the matrix");
    let lost = with(|file| {
        file.input("h_in", &[1, 4]);
        file.nodes("Tanh", &["h_in"], &["h_out"], &[]);
        file.nodes("Add", &["h_out", "obs"], &["actions"], &[]);
        file.output("h_out", &[1, 4]);
    });
    refused(
        lost,
        "\"h_in\" and the output \"h_out\" look like a recurrent state, but no LSTM or GRU cell is between them",
    );
}

#[test]
fn node_sizes_are_bounded_before_allocation() {
    let with_input = |dims: &[i64], build: &dyn Fn(&mut File)| {
        let mut file = File::default();
        file.input("obs", dims);
        build(&mut file);
        file.output("actions", &[1, 4]);
        file.bytes()
    };
    let product = |dims: [i64; 2], rows: i64, weights: [usize; 2]| {
        with_input(&dims, &|file| {
            let shape = file.ints(&[rows, dims[1]]);
            let x = file.node("Expand", &["obs", &shape], &[]);
            let w = file.reals(&weights, &vec![0.5; weights[0] * weights[1]]);
            file.nodes("MatMul", &[&x, &w], &["actions"], &[]);
        })
    };
    let values = product([1, 1], 1 << 20, [1, 1 << 16]);
    refused(values, "(MatMul): multiplies [1048576, 1] with [1, 65536], which gives more values than a policy");
    let work = product([1, 1024], 2048, [1024, 1024]);
    refused(work, "(MatMul): multiplies [2048, 1024] with [1024, 1024], which takes more work than a policy");
    let gathered = |op: &str, shape: &[i64]| {
        with(|file| {
            let (data, shape, zero) = (file.reals(&[1, 60_000], &[0.5; 60_000]), file.ints(shape), file.ints(&[0]));
            let indices = file.node("Expand", &[&zero, &shape], &[]);
            let rows = file.node(op, &[&data, &indices], &[]);
            file.nodes("Add", &["obs", &rows], &["actions"], &[]);
        })
    };
    for (op, shape) in [("Gather", &[4096][..]), ("GatherND", &[4096, 1])] {
        refused(gathered(op, shape), "shape [4096, 60000] has more values than a policy of this size can have");
    }
    // With padding every position has a matrix of its own.
    let convolution = |length: i64, kernel: [usize; 3], biases: usize, pads: [i64; 2]| {
        with_input(&[1, kernel[1] as i64, length], &|file| {
            let (w, b) = (file.drawn(&kernel), file.drawn(&[biases]));
            file.nodes("Conv", &["obs", &w, &b], &["actions"], &[("pads", Value::Ints(pads.to_vec()))]);
        })
    };
    refused(
        convolution(63, [64, 64, 64], 64, [31, 32]),
        "(Conv): removes columns of constants or padding from its matrix",
    );
    refused(convolution(4, [6, 2, 1], 1, [0, 0]), "(Conv): its bias has 1 values for 6 channels");
}

fn read(bytes: Vec<u8>) -> Result<()> {
    let dir = TempDir::new()?;
    Ok(import_bytes(bytes, dir.path(), "test", &Choice::default()).map(drop)?)
}

#[test]
fn damaged_bytes_never_end_the_process() {
    let whole = whole();
    assert!(read(whole.clone()).is_ok());
    for at in 0..whole.len() {
        let mut bytes = whole.clone();
        for value in [0, 0xff, whole[at] ^ 1, whole[at] ^ 0x80] {
            bytes[at] = value;
            // Any outcome is right, as long as it returns.
            drop(read(bytes.clone()));
        }
        drop(read(whole[..at].to_vec()));
    }
}

proptest! {
    #[test]
    fn random_bytes_never_end_the_process(bytes in prop::collection::vec(any::<u8>(), 0..400), at in 0usize..800, cut in any::<bool>()) {
        drop(read(bytes.clone()));
        let mut whole = whole();
        let at = at.min(whole.len());
        if cut {
            whole.truncate(at);
        }
        let end = (at + bytes.len()).min(whole.len());
        whole.splice(at.min(end)..end, bytes);
        drop(read(whole));
    }
}
