//! Malicious and damaged files: the importer refuses each with its fault, and none ends the process or fills the
//! memory.

use std::path::PathBuf;

use actq_onnx::{Choice, data_files, import_bytes, proto};
use anyhow::Result;
use proptest::prelude::*;
use tempfile::TempDir;

use super::file::{File, encoded, tensor};
use actq::import::Importer as _;
use actq_onnx::Onnx;

use super::refused;

/// Writes a file of an observation and an action of four values.
fn with(text: &str) -> Vec<u8> {
    with_initializers(&[], text)
}

fn with_initializers(tensors: &[proto::Tensor], text: &str) -> Vec<u8> {
    let mut file = File::default();
    file.input("obs", &[1, 4]);
    tensors.iter().for_each(|tensor| file.initializer(tensor));
    file.write(&[], text);
    file.output("actions", &[1, 4]);
    file.bytes()
}

fn whole() -> Vec<u8> {
    with("actions := Tanh(gemm(Elu(gemm(obs, 6, 4)), 4, 6))")
}

fn external_tensor(location: &str) -> proto::Tensor {
    let entry = proto::Entry { key: Some("location".to_owned()), value: Some(location.to_owned()) };
    proto::Tensor {
        raw_data: None,
        external_data: vec![encoded(&entry)],
        data_location: Some(1),
        ..tensor("w", &[4, 4], &[0.0; 16])
    }
}

fn external(location: &str) -> Vec<u8> {
    with_initializers(&[external_tensor(location)], "actions := MatMul(obs, w)")
}

/// A graph with a constant node and an initializer, both of another file, inside a branch of a node.
fn external_in_a_branch() -> Vec<u8> {
    let node = |name: &str, attribute: proto::Attribute| {
        let attribute = proto::Attribute { name: Some(name.to_owned()), ..attribute };
        encoded(&proto::Node { attribute: vec![encoded(&attribute)], ..Default::default() })
    };
    let constant = proto::Attribute { t: Some(encoded(&external_tensor("constant.bin"))), ..Default::default() };
    let branch = proto::Graph {
        node: vec![node("value", constant)],
        initializer: vec![encoded(&external_tensor("./inner/initializer.bin"))],
        ..Default::default()
    };
    let branch = proto::Attribute { g: Some(encoded(&branch)), ..Default::default() };
    let graph = proto::Graph { node: vec![node("then_branch", branch)], ..Default::default() };
    encoded(&proto::Model { graph: Some(encoded(&graph)), ..File::default().model() }).to_vec()
}

/// The addresses in a store depend on these files, and no output may replace them.
#[test]
fn files_of_weights_are_files_of_the_policy() -> std::io::Result<()> {
    let dir = tempfile::TempDir::new()?;
    let [policy, weights] = ["policy.onnx", "weights.bin"].map(|name| dir.path().join(name));
    std::fs::write(&policy, external("weights.bin"))?;
    assert_eq!(Onnx.files(&policy), [policy.clone(), weights]);
    std::fs::write(&policy, external_in_a_branch())?;
    assert_eq!(data_files(&policy).expect("a model"), ["constant.bin", "inner/initializer.bin"].map(PathBuf::from));
    std::fs::write(&policy, external("data/../../w.bin"))?;
    let error = format!("{:#}", data_files(&policy).expect_err("outside"));
    assert!(error.ends_with("tensor \"w\": the elements are in \"data/../../w.bin\", outside the model's folder; move that file beside the model"), "{error}");
    std::fs::write(&policy, whole())?;
    assert_eq!(Onnx.files(&policy), std::slice::from_ref(&policy));
    std::fs::write(&policy, "no model")?;
    assert_eq!(Onnx.files(&policy), [policy]);
    Ok(())
}

#[test]
fn each_malformed_file_is_refused_with_its_fault() {
    refused(&[], "the file is empty");
    refused(b"not an onnx file", "the file is not ONNX");
    let bytes = whole();
    refused(&bytes[..bytes.len() / 2], "the file is damaged or truncated");
    for (dims, expected) in [
        ([4, 1 << 40], "exceeds the limit of a tensor's elements"),
        ([4, 1 << 20], "needs 4194304 values, and 0 are present"),
    ] {
        let vast = proto::Tensor { raw_data: None, ..tensor("w", &dims, &[]) };
        refused(&with_initializers(&[vast], "actions := MatMul(obs, w)"), expected);
    }
    let not_finite = tensor("w", &[4, 4], &[f32::NAN; 16]);
    refused(&with_initializers(&[not_finite], "actions := MatMul(obs, w)"), "holds a value that is not finite");
    refused(&external("../secret"), "outside the model's folder");
    refused(&external("/etc/passwd"), "outside the model's folder");
    refused(
        &external("weights.bin"),
        "cannot read \"weights.bin\", which holds the elements (64 bytes); put it beside the model",
    );
    let doubled = "x = Concat(x, x, axis=1)\n".repeat(40);
    let doubled = format!("x = Identity(obs)\n{doubled}actions := Identity(x)");
    refused(&with(&doubled), "gives more values than a policy of this size can have");
    for (text, expected) in [
        ("actions := LayerNormalization(obs, full(1, 4), axis=-1, epsilon=-0.5)", "epsilon is -0.5"),
        ("actions := LayerNormalization(obs, full(1, 4), axis=-1, epsilon=0.0)", "it must be above 0"),
        ("actions := MatMul(obs, ConstantOfShape([8192, 8192]))", "more values than a policy of this size can have"),
        // Either side of the padding alone.
        (
            "actions := Pad(Pad(obs, [0, 600000, 0, 600000]), [2, 0, 2, 0])",
            "(Pad): shape [5, 1200004] has more values than a policy of this size can have",
        ),
        (
            "a := Add(obs, b)
             b := Tanh(a)
             actions := Tanh(b)",
            "node 0 \"/node/0\" (Add): reads \"b\", which no input, no initializer and no earlier node gives: the file has a cycle",
        ),
        ("actions := Add(obs, nowhere)", "reads \"nowhere\", which no input, no initializer and no earlier node gives"),
        ("actions := Dropout(obs, 0.5, [1])", "is in training mode, and drops values at random"),
        ("actions := MaxPool(obs, obs)", "node 0 \"/node/0\" (MaxPool): its kernel does not fit the shape [1, 4]"),
        ("actions := ConvTranspose(obs, obs)", "(ConvTranspose): has no kernel here; export the part after"),
        ("actions := MatMul(obs, obs)", "multiplies two values of the network, as attention does"),
        ("actions := Softmax(obs)", "(Softmax): has no kernel here"),
        ("actions := Sqrt(obs)", "node 0 \"/node/0\" (Sqrt): a square root has a kernel only within a norm"),
        (
            "actions := Frobnicate(obs)",
            "(Frobnicate): is not a supported operator; docs/IMPORT.md lists the supported operators",
        ),
        ("actions := Cast(obs, to=10)", "rounds a value of the network to float16"),
        ("actions := Clip(obs, min=2.0, max=1.0)", "limits to 2 .. 1; the lower limit exceeds the upper one"),
        ("actions := obs / full(0, 4)", "(Div): has a constant that is not finite, or divides by 0"),
        (
            "w = drawn(1, 16, 4)
             actions := LSTM(Unsqueeze(obs, [0]), w, drawn(1, 16, 4), hidden_size=4)",
            "state hidden is not carried to the next step; export it as an input of the graph",
        ),
        ("actions := GRU(obs, obs, obs, hidden_size=4)", "computes the reset gate before the matrix"),
    ] {
        refused(&with(text), expected);
    }
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
    refused(&encoded(&proto::Model { graph: Some(encoded(&nested)), ..File::default().model() }), "graphs are nested");
    let mut lost = File::default();
    lost.input("obs", &[1, 4]);
    lost.input("h_in", &[1, 4]);
    lost.write(&[], "h_out := Tanh(h_in)\nactions := h_out + obs");
    lost.output("h_out", &[1, 4]);
    lost.output("actions", &[1, 4]);
    refused(
        &lost.bytes(),
        "\"h_in\" and the output \"h_out\" look like a recurrent state, but no LSTM or GRU cell is between them",
    );
}

#[test]
fn node_sizes_are_bounded_before_allocation() {
    let gathered = "shape [4096, 60000] has more values than a policy of this size can have";
    for (dims, text, expected) in [
        (
            &[1, 1][..],
            "MatMul(Expand(obs, [1048576, 1]), full(0.5, 1, 65536))",
            "(MatMul): multiplies [1048576, 1] with [1, 65536], which gives more values than a policy",
        ),
        (
            &[1, 1024],
            "MatMul(Expand(obs, [2048, 1024]), full(0.5, 1024, 1024))",
            "(MatMul): multiplies [2048, 1024] with [1024, 1024], which takes more work than a policy",
        ),
        (&[1, 4], "obs + Gather(full(0.5, 1, 60000), Expand([0], [4096]))", gathered),
        (&[1, 4], "obs + GatherND(full(0.5, 1, 60000), Expand([0], [4096, 1]))", gathered),
        // With padding every position has a matrix of its own.
        (
            &[1, 64, 63],
            "Conv(obs, drawn(64, 64, 64), drawn(64), pads=[31, 32])",
            "(Conv): removes columns of constants or padding from its matrix",
        ),
        (
            &[1, 2, 4],
            "Conv(obs, drawn(6, 2, 1), drawn(1), pads=[0, 0])",
            "(Conv): its bias has 1 values for 6 channels",
        ),
    ] {
        let mut file = File::default();
        file.input("obs", dims);
        file.write(&[], &format!("actions := {text}"));
        file.output("actions", &[1, 4]);
        refused(&file.bytes(), expected);
    }
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
