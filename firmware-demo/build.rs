//! Puts the workspace's memory.x on the linker's path.

use std::path::Path;

fn main() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap_or(Path::new("."));
    println!("cargo::rustc-link-search={}", root.display());
    println!("cargo::rerun-if-changed={}", root.join("memory.x").display());
}
