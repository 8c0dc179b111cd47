//! The cost of the portable kernels on targets without the assembler, and of the kernels for Helium.

use std::path::Path;

use actq_bench::qemu::{Counter, Region};
use actq_bench::{Target, firmware, golden};
use actq_kernels::layout::Lanes;
use anyhow::{Result, ensure};

/// Instructions of a whole call of 256 x 256 weights by width, lanes and group, for the lanes of the build beside those of
/// the DSP extension. The firmware compares the results with the reference's, bit for bit.
fn counts(target: Target, elf: &Path, others: Option<Lanes>) -> Result<Vec<(String, f64)>> {
    let (text, regions) = Counter::build()?.run(target, elf, None, &[])?;
    // The firmware measures every layout of its build with row scales and with groups of 32.
    let is_built = |lanes: Lanes| Lanes::DSP.contains(&lanes) || Some(lanes) == others;
    let layouts = golden::layouts().filter(|(_, lanes, group)| is_built(*lanes) && [0, 32].contains(group)).count();
    ensure!(text.lines().count() == layouts && regions.len() == layouts, "{} regions: {text}", regions.len());
    let per_mac = |region: Region| region.instructions as f64 / (256.0 * 256.0);
    Ok(text.lines().zip(regions).map(|(line, region)| (line.to_owned(), per_mac(region))).collect())
}

/// Requires that the layouts of the DSP extension stay within the limits of row scales and of groups of 32, and the scalar
/// layouts within `scalar`: at 2, 3, 4 and 8 bits, each with row scales and with groups of 32.
fn stay_within(target: Target, [rows, groups]: [f64; 2], scalar: &[f64]) -> Result<()> {
    let elf = firmware::portable_binary("portable", target)?;
    let others = (!target.has_assembler()).then_some(Lanes::Scalar);
    let (scalar_lines, lines): (Vec<_>, Vec<_>) =
        counts(target, &elf, others)?.into_iter().partition(|(line, _)| line.contains(" Scalar "));
    let lines = lines.into_iter().map(|line| if line.0.ends_with(" 0") { (line, &rows) } else { (line, &groups) });
    let limits = scalar_lines.into_iter().zip(scalar).chain(lines);
    for ((line, per_mac), limit) in limits {
        println!("{target:?} {line}: {per_mac:.3}");
        assert!(line.starts_with("Portable "), "{line}");
        assert!(per_mac > 1.0 && per_mac <= *limit, "{target:?}, {line}: {per_mac:.3} instructions per MAC");
    }
    Ok(())
}

#[test]
fn portable_macs_take_few_instructions() -> Result<()> {
    stay_within(Target::Fpu, [3.5; 2], &[])
}

/// Without the DSP extension, a product takes more instructions, and the conversions from and to f32 are by integers. The
/// layouts of the DSP extension take little code there, and more time.
#[test]
fn macs_without_dsp_and_fpu_take_few_instructions() -> Result<()> {
    stay_within(Target::NoDsp, [7.1, 10.3], &[1.45, 2.05, 1.85, 2.5, 1.9, 2.7, 2.4, 3.15])
}

/// Armv6-M multiplies to 32 bits only.
#[test]
fn macs_on_armv6m_take_few_instructions() -> Result<()> {
    stay_within(Target::V6m, [11.4, 15.6], &[2.2, 3.25, 2.8, 3.85, 3.45, 4.85, 4.25, 5.6])
}

/// RV32IMAC has no instruction that multiplies and adds, and none that extracts bits: a weight takes two of both.
#[test]
fn macs_on_riscv_take_few_instructions() -> Result<()> {
    stay_within(Target::Riscv, [8.4, 10.7], &[2.2, 2.9, 2.85, 3.6, 3.05, 3.9, 3.75, 5.0])
}

/// Each width with row scales and with groups of 32.
#[test]
fn macs_with_helium_take_few_instructions() -> Result<()> {
    let counts = counts(Target::M55, &firmware::binary("portable", Target::M55)?, Some(Lanes::Helium))?;
    let counts = counts.into_iter().filter(|(line, _)| line.contains(" Helium "));
    for ((line, per_mac), limit) in counts.zip([0.18, 0.35, 0.24, 0.47, 0.18, 0.34, 0.175, 0.29]) {
        println!("{line}: {per_mac:.3}");
        assert!(line.starts_with("Helium "), "{line}");
        assert!(per_mac > 0.1 && per_mac <= limit, "{line}: {per_mac:.3} instructions per MAC");
    }
    Ok(())
}
