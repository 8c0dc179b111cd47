//! The functions on the Cortex-M4's FPU and on cores without one: the host's bits, and their cost.

use actq::methods::Activations;
use actq::policy::Policy;
use actq::runtime::ImageBuffer;
use actq_bench::cycles::Code;
use actq_bench::qemu::{self, Counter};
use actq_bench::{Target, firmware, rtn, shared_policies};
use actq_firmware_bench::functions::{LEN, each};
use actq_kernels::Width;
use anyhow::{Result, ensure};

/// Instructions per element: 12 without a function, 30 for one, and these.
fn limit(name: &str) -> u64 {
    match name {
        "add" | "mul" | "normalize" | "layernorm" | "rmsnorm" => 12,
        "denoise" | "denoise with noise" => 5,
        name if name.starts_with("denoise") => 12,
        "softplus" => 38,
        "exp" => 34,
        "cos" => 33,
        "noise" => 176,
        // Two products of 16 columns.
        "linear" => 80,
        _ => 30 * functions(name),
    }
}

/// Functions per element: an LSTM cell has three sigmoid gates and two hyperbolic tangents, a GRU cell two gates and
/// one.
fn functions(name: &str) -> u64 {
    match name {
        "lstm" => 5,
        "gru" => 3,
        _ => 1,
    }
}

/// The output of `firmware/bench/src/bin/functions.rs`: names and hashes of the results, in its order.
fn expected() -> Vec<(&'static str, u32)> {
    let mut all = Vec::new();
    each(|name, hash| {
        all.push((name, hash));
        Some(())
    });
    all
}

/// rustc would compute the loops of a Cortex-M55 with Helium, whose floats have other bits.
#[test]
fn functions_keep_their_bits_beside_helium() -> Result<()> {
    let elf = firmware::binary("functions", Target::M55)?;
    let output = qemu::run(qemu::command_on(Target::M55, &elf, None, "")?, &[])?;
    let text = String::from_utf8(output.stdout)?;
    let expected = expected().into_iter().map(|(name, hash)| format!("{name} {LEN} {hash:08x}\n"));
    assert_eq!(text, expected.collect::<String>());
    Ok(())
}

/// Whatever names the processor or the feature; the last processor counts.
#[test]
fn helium_by_rustc_is_refused() {
    let build = |flags| {
        let arguments = [
            "check",
            "--package",
            "actq-kernels",
            "--target",
            Target::M55.triple(),
            "--profile",
            Target::M55.profile(),
        ];
        firmware::cargo("the kernels", &arguments, &[("RUSTFLAGS", flags)])
    };
    let refused = [
        "-Ctarget-cpu=cortex-m85",
        "-C target-cpu=cortex-m33 --codegen target-cpu=cortex-m55",
        "-C target-cpu=cortex-m55 -C target-feature=-mve.fp",
        "-C target-feature=+mve.fp",
    ];
    for flags in refused {
        let error = build(flags).expect_err(flags).to_string();
        assert!(error.contains("flushes subnormal numbers"), "{flags}: {error}");
    }
    let accepted = build("-C target-cpu=cortex-m55 -C target-cpu=cortex-m33");
    assert!(accepted.is_ok(), "{accepted:?}");
}

#[test]
fn every_function_keeps_its_bits_and_instruction_limit() -> Result<()> {
    let elf = firmware::binary("functions", Target::Fpu)?;
    let (text, regions) = Counter::build()?.run(Target::Fpu, &elf, None, &[])?;
    let code = Code::read(&elf)?;
    let expected = expected();
    ensure!(text.lines().count() == expected.len() && regions.len() == expected.len(), "{text}");
    for ((line, region), (name, hash)) in text.lines().zip(regions).zip(expected) {
        assert_eq!(line, format!("{name} {LEN} {hash:08x}"));
        let per_element = |count: u64| count as f64 / LEN as f64;
        let (instructions, cycles) = (per_element(region.instructions), per_element(code.cycles(&region, 0)?));
        println!("{name:29} {instructions:7.2} instructions {cycles:7.2} cycles");
        assert!(
            instructions > 1.0 && instructions <= limit(name) as f64,
            "{name}: {instructions} instructions an element"
        );
    }
    Ok(())
}

/// Instructions per element without an FPU, at most: on a Cortex-M3, in Armv6-M code and on RV32IMAC.
const WITHOUT_FPU: [(&str, [u64; 3]); 19] = [
    ("relu", [6, 6, 7]),
    ("elu", [164, 318, 162]),
    ("silu", [200, 402, 203]),
    ("gelu", [966, 1872, 1147]),
    ("gelu_tanh", [495, 965, 566]),
    ("tanh", [176, 334, 174]),
    ("sigmoid", [166, 315, 156]),
    ("exp", [788, 1442, 934]),
    ("sin", [868, 1596, 1021]),
    ("cos", [952, 1776, 1154]),
    ("softplus", [863, 1657, 1000]),
    ("mish", [508, 1036, 604]),
    ("layernorm", [406, 737, 498]),
    ("rmsnorm", [214, 421, 250]),
    ("add", [56, 83, 64]),
    ("mul", [46, 103, 55]),
    ("normalize", [171, 279, 178]),
    ("lstm", [968, 1889, 1037]),
    ("gru", [1074, 2014, 1239]),
];

/// By integers, the functions have the bits of the FPU's.
#[test]
fn functions_without_fpu_keep_bits_and_instruction_limit() -> Result<()> {
    for (core, target) in [Target::NoDsp, Target::V6m, Target::Riscv].into_iter().enumerate() {
        let elf = firmware::binary("functions", target)?;
        let (text, regions) = Counter::build()?.run(target, &elf, None, &[])?;
        let expected = expected();
        ensure!(text.lines().count() == expected.len() && regions.len() == expected.len(), "{target:?}: {text}");
        for ((line, region), (name, hash)) in text.lines().zip(regions).zip(expected) {
            assert_eq!(line, format!("{name} {LEN} {hash:08x}"), "{target:?}");
            let instructions = region.instructions as f64 / LEN as f64;
            println!("{target:?} {name:29} {instructions:7.2} instructions");
            if let Some((_, limits)) = WITHOUT_FPU.iter().find(|(limited, _)| *limited == name) {
                assert!(
                    instructions <= limits[core] as f64,
                    "{target:?} {name}: {instructions} instructions an element"
                );
            }
        }
    }
    Ok(())
}

/// The gates of an LSTM are a small part of its head.
#[test]
fn an_lstm_head_keeps_its_instruction_limit() -> Result<()> {
    let Some(policies) = shared_policies() else { return Ok(()) };
    let policy = Policy::load(&policies.join("g1_lstm256"))?;
    let bytes = rtn(&policy, Width::W3, 0, Activations::Auto)?;
    let slot = qemu::slot(&bytes)?;
    let buffer = ImageBuffer::new(&bytes);
    let matrices = buffer.image(slot.path())?.ops().filter_map(|op| op.matrix());
    let macs = matrices.map(|matrix| matrix.rows * matrix.cols).sum::<usize>() as f64;
    let elf = firmware::harness(Target::Fpu)?;
    let (_, regions) = Counter::build()?.run(Target::Fpu, &elf, Some(slot.path()), &[])?;
    ensure!(!regions.is_empty(), "counted no step");
    for count in regions.into_iter().map(|region| region.instructions) {
        println!("g1_lstm256 at 3 bits: {:.3} instructions per MAC", count as f64 / macs);
        assert!(count as f64 <= 1.30 * macs, "{count} instructions for {macs} MACs");
    }
    Ok(())
}
