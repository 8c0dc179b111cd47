//! Detects the backends of the target; `src/arch/mod.rs` chooses one. Stable rustc does not report `target_feature =
//! "dsp"`, so the target's name decides. For Armv8-M, where the extension is optional, the processor that the build
//! names (`-C target-cpu=cortex-m33`) decides, unless it excludes the extension (`-C target-feature=-dsp`). A processor
//! with Helium is refused unless rustc may not use Helium (`-C target-feature=-mve`).
//! `actq_kernels::BACKEND` is the backend of the build. The environment variable `ACTQ_BACKEND=portable` excludes the
//! assembler, for comparisons and for builds without assembler.

/// Armv8-M processors with the DSP extension, by LLVM's defaults.
const WITH_DSP: [&str; 6] = ["cortex-m33", "cortex-m35p", "cortex-m52", "cortex-m55", "cortex-m85", "star-mc3"];
/// Those with Helium.
const WITH_HELIUM: [&str; 4] = ["cortex-m52", "cortex-m55", "cortex-m85", "star-mc3"];

fn main() {
    println!("cargo::rustc-check-cfg=cfg(actq_armv7em)");
    println!("cargo::rustc-check-cfg=cfg(actq_armv6m)");
    println!("cargo::rustc-check-cfg=cfg(actq_armv7m)");
    println!("cargo::rustc-check-cfg=cfg(actq_rv32im)");
    println!("cargo::rustc-check-cfg=cfg(actq_zba)");
    println!("cargo::rustc-check-cfg=cfg(actq_loops)");
    println!("cargo::rustc-check-cfg=cfg(actq_scaling)");
    println!("cargo::rustc-check-cfg=cfg(actq_armv8m)");
    println!("cargo::rustc-check-cfg=cfg(actq_helium)");
    println!("cargo::rustc-check-cfg=cfg(actq_fpu)");
    println!("cargo::rustc-check-cfg=cfg(actq_soft)");
    println!("cargo::rustc-check-cfg=cfg(actq_narrow)");
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed=ACTQ_BACKEND");
    let target = std::env::var("TARGET").unwrap_or_default();
    let portable = match std::env::var("ACTQ_BACKEND").as_deref() {
        Ok("portable") => true,
        Ok("") | Err(_) => false,
        Ok(other) => panic!("ACTQ_BACKEND is {other:?}; set it to `portable` or unset it"),
    };
    let flags = Flags::read();
    if target.starts_with("thumb") && flags.let_rustc_use_helium() {
        println!("cargo::error={HELIUM_BY_RUSTC}");
    }
    if !has_fpu(&target) {
        println!("cargo::rustc-cfg=actq_soft");
    }
    // Neither a product of 64 bits nor a division.
    if target.starts_with("thumbv6m") {
        println!("cargo::rustc-cfg=actq_narrow");
    }
    // Loops of the scalar layouts, and the scaling of sums. Those of RISC-V are compressed code.
    let loops = [("thumbv6m", "actq_armv6m"), ("thumbv7m-", "actq_armv7m"), ("riscv32im", "actq_rv32im")];
    let fits = !portable && (!target.starts_with("riscv") || has_feature("c"));
    if let Some((_, loops)) = loops.iter().find(|(prefix, _)| target.starts_with(prefix) && fits) {
        println!("cargo::rustc-cfg={loops}");
        println!("cargo::rustc-cfg=actq_loops");
        if has_feature("zba") {
            println!("cargo::rustc-cfg=actq_zba");
        }
        if !has_fpu(&target) {
            println!("cargo::rustc-cfg=actq_scaling");
        }
    }
    let dsp = target.starts_with("thumbv7em") || target.starts_with("thumbv8m.main") && flags.have_dsp();
    if dsp && !portable {
        println!("cargo::rustc-cfg=actq_armv7em");
        if target.starts_with("thumbv8m") {
            println!("cargo::rustc-cfg=actq_armv8m");
        }
        // The kernels that convert from and to f32 need the registers of the hard-float target.
        if target.ends_with("eabihf") {
            println!("cargo::rustc-cfg=actq_fpu");
            if flags.have_helium() && std::env::var_os("CARGO_FEATURE_HELIUM").is_some() {
                println!("cargo::rustc-cfg=actq_helium");
            }
        }
    }
}

/// Returns `true` if rustc reports a feature of the target.
fn has_feature(name: &str) -> bool {
    let features = std::env::var("CARGO_CFG_TARGET_FEATURE").unwrap_or_default();
    features.split(',').any(|feature| feature == name)
}

/// Returns `true` if the target's floats are not in software. Stable rustc does not report RISC-V's `f`; the letters of
/// the architecture's name have it, or `g`, which includes it.
fn has_fpu(target: &str) -> bool {
    match target.split_once('-').map_or(target, |(architecture, _)| architecture) {
        thumb if thumb.starts_with("thumb") => target.ends_with("eabihf"),
        riscv if riscv.starts_with("riscv") => {
            has_feature("f") || riscv.get("riscv32".len()..).is_some_and(|letters| letters.contains(['f', 'g']))
        }
        _ => true,
    }
}

/// The refusal of a build whose numbers would have other bits.
const HELIUM_BY_RUSTC: &str = "rustc would compute f32 with Helium, which flushes subnormal numbers: the results would have \
    other bits than on every other machine. Add `-C target-feature=-mve` to the flags (rustc warns that it does not \
    know this name, and passes it on; the feature `helium` has kernels in assembler), or compile for \
    `-C target-cpu=cortex-m33`.";

/// The compiler's flags.
struct Flags(String);

impl Flags {
    fn read() -> Self {
        Self(std::env::var("CARGO_ENCODED_RUSTFLAGS").unwrap_or_default())
    }

    /// Returns the processor: the last one counts.
    fn processor(&self) -> &str {
        let mut last = self.0.split('\u{1f}').rev().filter_map(|flag| flag.split_once("target-cpu="));
        last.next().map_or("", |(_, processor)| processor.trim())
    }

    /// Returns `true` if a flag has this feature with its sign.
    fn have(&self, feature: &str) -> bool {
        self.0.split(['\u{1f}', '=', ',', ' ']).any(|word| word == feature)
    }

    /// Returns `true` if the processor has the DSP extension, and no flag excludes it.
    fn have_dsp(&self) -> bool {
        WITH_DSP.contains(&self.processor()) && !self.have("-dsp")
    }

    /// Returns `true` if the processor has Helium.
    fn have_helium(&self) -> bool {
        WITH_HELIUM.contains(&self.processor()) || self.have("+mve") || self.have("+mve.fp")
    }

    /// Returns `true` if the compiler may use Helium.
    fn let_rustc_use_helium(&self) -> bool {
        self.have_helium() && !self.have("-mve")
    }
}
