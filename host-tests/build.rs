//! Takes the Rust examples out of the documents, for rustdoc to test: it would take the terminal's text there for Rust
//! as well.

use std::path::PathBuf;
use std::{env, fs, io};

fn main() -> io::Result<()> {
    let folder = |variable| env::var_os(variable).map(PathBuf::from).unwrap_or_default();
    let root = folder("CARGO_MANIFEST_DIR").join("..");
    // The image that the examples include.
    let image = format!("{:?}", root.join("kernels/tests/valid.actq"));
    let mut examples = String::new();
    for document in ["README.md", "kernels/README.md", "firmware-demo/README.md"] {
        let path = root.join(document);
        println!("cargo::rerun-if-changed={}", path.display());
        let text = fs::read_to_string(path)?;
        let listings = text.split("\n```rust").skip(1).filter_map(|rest| rest.split_once("\n```"));
        examples.extend(
            listings.map(|(listing, _)| format!("```rust{}\n```\n\n", listing.replace("\"model.actq\"", &image))),
        );
    }
    fs::write(folder("OUT_DIR").join("examples.md"), examples)
}
