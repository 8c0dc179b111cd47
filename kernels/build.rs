//! Says which backends the target has; `src/arch/mod.rs` chooses. Stable rustc shows no `target_feature = "dsp"`, so
//! the target's name decides, and for Armv8-M, where the extension is an option, the processor that the build names
//! (`-C target-cpu=cortex-m33`). `actq_kernels::arch::BACKEND` says which backend was compiled in. The environment
//! variable `ACTQ_BACKEND=portable` leaves the assembler out: to compare, or where assembler is not wanted.

/// Processors of Armv8-M whose DSP extension LLVM takes for granted.
const WITH_DSP: [&str; 5] = ["cortex-m33", "cortex-m35p", "cortex-m52", "cortex-m55", "cortex-m85"];

fn main() {
    println!("cargo::rustc-check-cfg=cfg(actq_armv7em)");
    println!("cargo::rustc-check-cfg=cfg(actq_armv8m)");
    println!("cargo::rustc-check-cfg=cfg(actq_fpu)");
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed=ACTQ_BACKEND");
    let target = std::env::var("TARGET").unwrap_or_default();
    let portable = match std::env::var("ACTQ_BACKEND").as_deref() {
        Ok("portable") => true,
        Ok("") | Err(_) => false,
        Ok(other) => panic!("ACTQ_BACKEND is {other:?}; it may be `portable` or not set"),
    };
    let dsp = target.starts_with("thumbv7em") || target.starts_with("thumbv8m.main") && flags_have_dsp();
    if dsp && !portable {
        println!("cargo::rustc-cfg=actq_armv7em");
        if target.starts_with("thumbv8m") {
            println!("cargo::rustc-cfg=actq_armv8m");
        }
        // The hard-float target; the kernels that convert from and to f32 need its registers.
        if target.ends_with("eabihf") {
            println!("cargo::rustc-cfg=actq_fpu");
        }
    }
}

/// Whether the last processor that the compiler's flags name has the DSP extension.
fn flags_have_dsp() -> bool {
    let flags = std::env::var("CARGO_ENCODED_RUSTFLAGS").unwrap_or_default();
    let processor =
        flags.split('\u{1f}').rev().find_map(|flag| flag.trim_start_matches("-C").strip_prefix("target-cpu="));
    processor.is_some_and(|processor| WITH_DSP.contains(&processor))
}
