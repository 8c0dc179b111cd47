//! What a build script of a firmware tells cargo.

use std::env;
use std::path::Path;

use crate::Target;

/// Links the package's binaries for the board of the target that is built for; on the host, does nothing. For build scripts of
/// packages one folder below the workspace's root.
pub fn link() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-check-cfg=cfg(actq_small)");
    let Some(board) = env::var("TARGET").ok().and_then(|triple| Target::of(&triple)).map(Target::board) else { return };
    // The variable of this run: a build script may have been compiled for another checkout.
    let package = env::var("CARGO_MANIFEST_DIR").unwrap_or_default();
    let root = Path::new(&package).parent().unwrap_or(Path::new("."));
    for script in ["memory.x", board.memory] {
        println!("cargo::rerun-if-changed={}", root.join(script).display());
    }
    println!("cargo::rustc-link-search={}", root.display());
    if board.memory != "memory.x" {
        println!("cargo::rustc-link-arg-bins=-T{}", root.join(board.memory).display());
    }
    println!("cargo::rustc-link-arg-bins=-Tlink.x");
    if board.small {
        println!("cargo::rustc-cfg=actq_small");
    }
}
