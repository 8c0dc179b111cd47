//! The instructions to cargo from a firmware's build script.

use std::path::{Path, PathBuf};
use std::{env, fs};

use crate::table::Target;

/// The default board's memory script, which link.x finds at the workspace's root.
const DEFAULT_MEMORY: &str = "memory.x";

/// Links the package's binaries for a board; does nothing for the host. For build scripts of packages within the
/// workspace, whose root has the default board's script.
///
/// # Errors
///
/// Fails if a feature selects a board of another compiler target, if features select two boards, or if a linker script
/// cannot be written.
pub fn link() -> Result<(), String> {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-check-cfg=cfg(actq_small)");
    println!("cargo::rustc-check-cfg=cfg(actq_armv6m)");
    let Some(target) = target()? else { return Ok(()) };
    let board = target.board();
    // From the variable of this run, because the build script may have been compiled for another checkout.
    let [package, out] =
        ["CARGO_MANIFEST_DIR", "OUT_DIR"].map(|name| PathBuf::from(env::var_os(name).unwrap_or_default()));
    let root = package.ancestors().find(|folder| folder.join(DEFAULT_MEMORY).is_file()).unwrap_or(Path::new("."));
    let script = root.join(board.memory);
    println!("cargo::rerun-if-changed={}", script.display());
    if target.triple().starts_with("riscv") {
        // riscv-rt's link.x includes no memory.x.
        println!("cargo::rustc-link-arg-bins=-T{}", script.display());
    } else {
        // cortex-m-rt's link.x includes `memory.x`. Cargo starts the linker in the workspace's root, and the linker
        // looks there before its search path, so it always finds the default board's file. For another board it is
        // mapped to that board's file.
        println!("cargo::rustc-link-search={}", root.display());
        if board.memory != DEFAULT_MEMORY {
            println!("cargo::rustc-link-arg-bins=--remap-inputs=*{DEFAULT_MEMORY}={}", script.display());
        }
        // link.x also includes device.x, which makes the handler SERIAL optional.
        fs::write(out.join("device.x"), "PROVIDE(SERIAL = DefaultHandler);\n")
            .map_err(|error| format!("device.x: {error}"))?;
        println!("cargo::rustc-link-search={}", out.display());
    }
    println!("cargo::rustc-link-arg-bins=-Tlink.x");
    if env::vars_os().any(|(name, _)| name.to_string_lossy().starts_with("CARGO_FEATURE_DEFMT")) {
        println!("cargo::rustc-link-arg-bins=-Tdefmt.x");
    }
    if target.triple().starts_with("thumbv6m") {
        println!("cargo::rustc-cfg=actq_armv6m");
    }
    if board.small {
        println!("cargo::rustc-cfg=actq_small");
    }
    Ok(())
}

/// Returns the build's target: the board that a feature selects, else the first one of the compiler's target.
fn target() -> Result<Option<Target>, String> {
    let triple = env::var("TARGET").unwrap_or_default();
    let Some(default) = Target::of(&triple) else { return Ok(None) };
    let chosen = |target: &Target| {
        let name = target.board().name.to_uppercase().replace('-', "_");
        env::var_os(format!("CARGO_FEATURE_{name}")).is_some()
    };
    let mut boards: Vec<Target> = Target::ALL.into_iter().filter(chosen).collect();
    boards.dedup_by_key(|target| target.board().name);
    match boards[..] {
        [] => Ok(Some(default)),
        [board] => {
            let name = board.board().name;
            let same = |target: &Target| target.board().name == name && target.triple() == triple;
            let found = Target::ALL.into_iter().find(same);
            found.map(Some).ok_or(format!("board {name} needs --target {}, not {triple}", board.triple()))
        }
        [one, other, ..] => {
            Err(format!("features select two boards, {} and {}; select one", one.board().name, other.board().name))
        }
    }
}
