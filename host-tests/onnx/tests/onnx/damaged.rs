//! Malicious and damaged files: the importer refuses each with its fault, and none ends the process or fills the
//! memory.

use std::path::PathBuf;

use actq_onnx::{ImportOptions, data_files, import_bytes, proto};
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
    super::file::external(&[4, 4], &[("location", location)])
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
}

fn read(bytes: Vec<u8>) -> Result<()> {
    let dir = TempDir::new()?;
    Ok(import_bytes(bytes, dir.path(), "test", &ImportOptions::default()).map(drop)?)
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
