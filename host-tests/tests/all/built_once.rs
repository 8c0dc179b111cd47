//! One build of the library serves every selection of packages that `cargo verify --all` tests: see `tools/features`.

use std::collections::{BTreeMap, BTreeSet};

use actq_bench::firmware::cargo;
use anyhow::{Result, ensure};

/// Returns the sets of features that each crate of a selection is built with, by name and version.
fn features(selection: &[&str]) -> Result<BTreeMap<String, BTreeSet<String>>> {
    let tree = ["tree", "--locked", "--no-dedupe", "--prefix", "none", "--format", "{p}|{f}"];
    let mut crates = BTreeMap::<String, BTreeSet<String>>::new();
    for line in cargo("the tree of packages", &[&tree, selection].concat(), &[])?.lines() {
        let Some((package, features)) = line.split_once('|') else { continue };
        let name = package.split(' ').take(2).collect::<Vec<_>>().join(" ");
        crates.entry(name).or_default().insert(features.trim_end_matches("(*)").trim().to_owned());
    }
    Ok(crates)
}

#[test]
fn every_selection_has_the_features_of_the_tests() -> Result<()> {
    let tests = features(&["--edges", "normal,build,dev"])?;
    let command = features(&["--edges", "normal,build", "--package", "actq-cli"])?;
    let selections: [(&[&str], &str); 3] = [
        (&["--package", "actq-bench"], "normal,build"),
        (&["--package", "actq-cli", "--package", "actq-python"], "normal,build"),
        (&["--package", "actq-onnx-tests"], "normal,build,dev"),
    ];
    for (packages, edges) in selections {
        let selected = features(&[&["--edges", edges], packages].concat())?;
        for name in command.keys() {
            let (Some(here), Some(there)) = (selected.get(name), tests.get(name)) else { continue };
            ensure!(
                !here.is_disjoint(there),
                "{packages:?} build {name} again, with {here:?} instead of {there:?}; add a line to tools/features/Cargo.toml"
            );
        }
    }
    Ok(())
}
