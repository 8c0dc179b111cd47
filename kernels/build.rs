//! Says which backends the target has; `src/arch/mod.rs` chooses. Stable rustc shows no `target_feature = "dsp"` for thumbv7em, so
//! the target's name decides; `actq_kernels::arch::BACKEND` says which one was compiled in. The environment variable `ACTQ_BACKEND=portable` leaves the
//! assembler out: to compare, or where assembler is not wanted.

fn main() {
    println!("cargo::rustc-check-cfg=cfg(actq_armv7em)");
    println!("cargo::rustc-check-cfg=cfg(actq_fpu)");
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed=ACTQ_BACKEND");
    let target = std::env::var("TARGET").unwrap_or_default();
    let portable = match std::env::var("ACTQ_BACKEND").as_deref() {
        Ok("portable") => true,
        Ok("") | Err(_) => false,
        Ok(other) => panic!("ACTQ_BACKEND is {other:?}; it may be `portable` or not set"),
    };
    if target.starts_with("thumbv7em") && !portable {
        println!("cargo::rustc-cfg=actq_armv7em");
        // The hard-float target; the kernels that convert from and to f32 need its registers.
        if target.ends_with("eabihf") {
            println!("cargo::rustc-cfg=actq_fpu");
        }
    }
}
