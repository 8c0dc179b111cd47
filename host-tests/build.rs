//! Takes the Rust examples out of README.md, for rustdoc to test: it would take the terminal's text there for Rust as
//! well.

use std::path::PathBuf;
use std::{env, fs, io};

fn main() -> io::Result<()> {
    let folder = |variable| env::var_os(variable).map(PathBuf::from).unwrap_or_default();
    let readme = folder("CARGO_MANIFEST_DIR").join("../README.md");
    println!("cargo::rerun-if-changed={}", readme.display());
    let text = fs::read_to_string(readme)?;
    let examples = text.split("\n```rust").skip(1).filter_map(|rest| rest.split_once("\n```"));
    let examples: String = examples.map(|(example, _)| format!("```rust{example}\n```\n\n")).collect();
    fs::write(folder("OUT_DIR").join("examples.md"), examples)
}
