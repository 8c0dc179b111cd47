//! Chooses the GEMV backend. Stable rustc shows no `target_feature = "dsp"` for thumbv7em, so the target's name decides;
//! `actq_kernels::gemv::BACKEND` says which one was compiled in.

fn main() {
    println!("cargo::rustc-check-cfg=cfg(actq_armv7em)");
    println!("cargo::rustc-check-cfg=cfg(actq_fpu)");
    println!("cargo::rerun-if-changed=build.rs");
    let target = std::env::var("TARGET").unwrap_or_default();
    if target.starts_with("thumbv7em") {
        println!("cargo::rustc-cfg=actq_armv7em");
        // The hard-float target; the kernels that convert from and to f32 need its registers.
        if target.ends_with("eabihf") {
            println!("cargo::rustc-cfg=actq_fpu");
        }
    }
}
