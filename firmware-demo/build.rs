//! Puts the workspace's memory.x and memory-riscv32.x on the linker's path, and fits the first to a small machine.

use std::path::Path;

/// QEMU's microbit, a Cortex-M0, has 256 KB of flash, no image slot behind them, and 16 KB of RAM.
const MICROBIT: [(&str, u32); 3] =
    [("_stack_start", 0x2000_4000), ("_image_slot_start", 0x0004_0000), ("_image_slot_end", 0x0004_0000)];

fn main() {
    // The variable of this run: a build script may have been compiled for another checkout.
    let package = std::env::var("CARGO_MANIFEST_DIR").unwrap_or_default();
    let root = Path::new(&package).parent().unwrap_or(Path::new("."));
    println!("cargo::rustc-link-search={}", root.display());
    for script in ["memory.x", "memory-riscv32.x"] {
        println!("cargo::rerun-if-changed={}", root.join(script).display());
    }
    println!("cargo::rustc-check-cfg=cfg(actq_small)");
    if std::env::var("TARGET").is_ok_and(|target| target.starts_with("thumbv6m")) {
        println!("cargo::rustc-cfg=actq_small");
        for (symbol, value) in MICROBIT {
            println!("cargo::rustc-link-arg-bins=--defsym={symbol}={value:#x}");
        }
    }
}
