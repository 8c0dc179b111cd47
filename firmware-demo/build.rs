//! Puts the memory.x of the target's machine on the linker's path.

use std::path::Path;

fn main() {
    println!("cargo::rustc-check-cfg=cfg(actq_small)");
    let target = std::env::var("TARGET").unwrap_or_default();
    // A Cortex-M0 has little memory: QEMU has it as the microbit. The machines of the others have one layout.
    let small = target.starts_with("thumbv6m");
    if small {
        println!("cargo::rustc-cfg=actq_small");
    }
    let package = std::env::var("CARGO_MANIFEST_DIR").unwrap_or_default();
    let folder = Path::new(&package).join(if small { "microbit" } else { "mps2" });
    println!("cargo::rustc-link-search={}", folder.display());
    println!("cargo::rerun-if-changed={}", folder.join("memory.x").display());
}
