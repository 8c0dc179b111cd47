//! Bundles that tests write, and published ones with any of their references.
#![allow(dead_code, reason = "each test uses some of it")]

use std::fs;
use std::path::PathBuf;

use actq::error::{Result, ensure};
use actq_deploy::{Answers, Bundle, Plan, Reading, Reference, read};
use tempfile::TempDir;

/// Returns a file or folder of the shared folder, or nothing without it.
pub(crate) fn shared_file(path: &str) -> Option<PathBuf> {
    match std::env::var_os("ACTQ_SHARED") {
        Some(folder) => Some(PathBuf::from(folder).join(path)),
        None => {
            println!("not run: ACTQ_SHARED does not name the shared folder");
            None
        }
    }
}

/// Returns the folder of a published bundle, or nothing without the shared folder.
pub(crate) fn shared(name: &str) -> Option<PathBuf> {
    shared_file(&format!("bundles/{name}"))
}

/// Reads a published bundle with its family's profile, and compares it with a reference.
pub(crate) fn agrees(name: &str, expect: &str, answers: &str) -> Result<()> {
    let Some(folder) = shared(name) else { return Ok(()) };
    let bundle = Bundle::open(&folder.join("bundle"))?;
    let reading = read(&bundle, true, Answers::parse(answers)?)?;
    ensure!(reading.questions.is_empty(), "{name}: {:#?}", reading.questions);
    let reference = Reference::read(&folder.join("raw.npz"), &folder.join(expect))?;
    let comparison = reference.compare(Plan::new(&reading.description, &bundle)?)?;
    println!("{name}, {expect}: {:?}, unread {:?}", comparison.largest, reading.unread);
    comparison.require_equal()
}

/// Returns the message of an error with its contexts.
pub(crate) fn message(result: Result<Reading>) -> String {
    result.map_or_else(|error| format!("{error:#}"), |reading| format!("accepted: {:?}", reading.description))
}

/// A bundle that a test writes.
pub(crate) struct Made(TempDir);

impl Made {
    pub(crate) fn new() -> Result<Self> {
        Ok(Self(TempDir::new()?))
    }

    pub(crate) fn write(&self, name: &str, bytes: &[u8]) -> Result<()> {
        let path = self.0.path().join(name);
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder)?;
        }
        Ok(fs::write(path, bytes)?)
    }

    pub(crate) fn bundle(&self) -> Result<Bundle> {
        Bundle::open(self.0.path())
    }
}

/// An ONNX file without operators: inputs and outputs with their lengths, and metadata.
pub(crate) struct Onnx<'a> {
    pub(crate) inputs: &'a [(&'a str, usize)],
    pub(crate) outputs: &'a [(&'a str, usize)],
    pub(crate) metadata: &'a [(&'a str, &'a str)],
}

impl Onnx<'_> {
    /// Returns the file.
    pub(crate) fn bytes(&self) -> Vec<u8> {
        let mut graph = Vec::new();
        for (tag, ports) in [(11, self.inputs), (12, self.outputs)] {
            for (name, len) in ports {
                let axis = field(1, &[vec![8], varint(*len)].concat());
                let tensor = [vec![8, 1], field(2, &axis)].concat();
                graph.extend(field(tag, &[field(1, name.as_bytes()), field(2, &field(1, &tensor))].concat()));
            }
        }
        appended([field(7, &graph), field(8, &[16, 17])].concat(), self.metadata)
    }
}

/// Appends metadata to an ONNX file.
pub(crate) fn appended(mut onnx: Vec<u8>, metadata: &[(&str, &str)]) -> Vec<u8> {
    for (key, value) in metadata {
        onnx.extend(field(14, &[field(1, key.as_bytes()), field(2, value.as_bytes())].concat()));
    }
    onnx
}

/// Encodes a field of protobuf that has a length.
fn field(tag: usize, content: &[u8]) -> Vec<u8> {
    [varint(tag << 3 | 2), varint(content.len()), content.to_vec()].concat()
}

fn varint(mut number: usize) -> Vec<u8> {
    let mut bytes = Vec::new();
    while number > 127 {
        bytes.push(number as u8 | 128);
        number >>= 7;
    }
    bytes.push(number as u8);
    bytes
}
