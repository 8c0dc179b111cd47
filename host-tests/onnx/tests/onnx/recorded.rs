//! The actions of tract, another reader of ONNX, which takes minutes to build: recorded in `recorded.txt`, a line for
//! each file and its observations, the start of their digest and the actions.
//!
//! `cargo test --profile checks -p actq-onnx-tests --features tract` compares the record with tract;
//! `UPDATE_EXPECT=1` before it, without a filter of tests, records anew.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use actq_cli::report::export::sha256;
use actq_onnx::Imported;
use anyhow::{Context as _, Result};

type Record = BTreeMap<String, Vec<f32>>;

static RECORD: LazyLock<Record> = LazyLock::new(|| {
    let line = |line: &str| {
        let (digest, actions) = line.split_once(' ')?;
        Some((digest.to_owned(), actions.split(' ').map(str::parse).collect::<Result<_, _>>().ok()?))
    };
    include_str!("recorded.txt").lines().map(|text| line(text).expect("a digest and actions")).collect()
});

/// Returns the actions of tract, step by step, with every state carried on.
pub(super) fn by_tract(bytes: &[u8], imported: &Imported, observations: &[Vec<f32>]) -> Result<Vec<Vec<f32>>> {
    let mut key = bytes.to_vec();
    key.extend(observations.iter().flatten().flat_map(|value| value.to_le_bytes()));
    let digest = sha256(&key)[..16].to_owned();
    #[cfg(feature = "tract")]
    {
        let found = super::tract::computed(bytes, imported, observations)?;
        if std::env::var_os("UPDATE_EXPECT").is_some() {
            record(digest, found.concat())?;
        } else {
            super::compare(&[recorded(&digest)?], &[found.concat()])?;
        }
        Ok(found)
    }
    #[cfg(not(feature = "tract"))]
    {
        let _ = imported;
        let actions = recorded(&digest)?;
        Ok(actions.chunks(actions.len() / observations.len()).map(<[f32]>::to_vec).collect())
    }
}

fn recorded(digest: &str) -> Result<Vec<f32>> {
    let found = RECORD.get(digest).cloned();
    found.context("tract's actions for this file are not in recorded.txt: run these tests with `--features tract`")
}

/// Writes the actions of all files so far.
#[cfg(feature = "tract")]
fn record(digest: String, actions: Vec<f32>) -> Result<()> {
    static FOUND: std::sync::Mutex<Record> = std::sync::Mutex::new(Record::new());
    let mut found = FOUND.lock().expect("no test panics here");
    found.insert(digest, actions);
    let line = |(digest, actions): (&String, &Vec<f32>)| {
        let actions: Vec<String> = actions.iter().map(f32::to_string).collect();
        format!("{digest} {}\n", actions.join(" "))
    };
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/onnx/recorded.txt");
    Ok(std::fs::write(path, found.iter().map(line).collect::<String>())?)
}
