//! Networks on every core: instructions, memory and code of our own images, and of other projects' code.

pub(crate) mod cases;
mod compilers;
mod others;

use std::fs;
use std::path::Path;

use actq::emit::{Core, repack};
use actq::runtime::ImageBuffer;
use actq_bench::Target;
use actq_bench::firmware::{harness, kernel_bytes};
use actq_bench::qemu::{self, Counter};
use actq_cli::report::table::table;
use actq_kernels::Width;
use actq_kernels::math::Function;
use anyhow::{Context as _, Result};
use serde::Serialize;

use cases::CASES;

/// Cores that run in QEMU, with the harness of a board.
const CORES: [(&str, Core, Target); 6] = [
    ("m4f", Core::M4f, Target::Fpu),
    ("m55", Core::M55, Target::M55),
    ("m3", Core::M3, Target::NoDsp),
    ("m0", Core::M0, Target::V6m),
    ("rv32imac", Core::Rv32imac, Target::Riscv),
    ("rv32zb", Core::Rv32zb, Target::RiscvZb),
];

/// The figures of an image on a core.
#[derive(Debug, Serialize)]
struct Row {
    core: &'static str,
    network: &'static str,
    /// The function between its layers, if it has more than one.
    function: Option<&'static str>,
    bits: u32,
    /// Instructions of a step.
    instructions: u64,
    macs: usize,
    /// Bytes of scratch memory.
    scratch: usize,
    /// Bytes of stack of a step.
    stack: u64,
    /// Bytes of the kernels' functions in the program, which runs any image.
    code: u64,
}

/// Measures all rows, prints them, and writes them to `json`: `ours` alone, or all projects' in `folder`, which is a
/// temporary one if it is not given.
pub(crate) fn run(ours: bool, words: &[String], folder: Option<&Path>, json: Option<&Path>) -> Result<()> {
    let rows = if ours {
        serde_json::to_value(own()?)?
    } else {
        let temporary = tempfile::tempdir()?;
        others::measure(folder.unwrap_or(temporary.path()), words)?
    };
    if let Some(path) = json {
        let text = serde_json::to_string_pretty(&rows)? + "\n";
        fs::write(path, text).with_context(|| path.display().to_string())?;
    }
    Ok(())
}

/// Measures our own rows, and prints them.
fn own() -> Result<Vec<Row>> {
    let counter = Counter::build()?;
    let mut rows = Vec::new();
    for (name, core, target) in CORES {
        for case in &CASES {
            for width in Width::ALL {
                let bytes = repack(&case.quantized(width)?.0.image, core)?;
                let buffer = ImageBuffer::new(&bytes);
                let scratch = 4 * buffer.image(Path::new(case.name))?.scratch_words();
                let file = qemu::slot(&bytes)?;
                let (elf, slot) = (harness(target)?, Some(file.path()));
                let (_, regions) = counter.run(target, &elf, slot, &[])?;
                let instructions = regions.first().context("the harness has run no step")?.instructions;
                let (code, stack) = (kernel_bytes(&elf)?, stack(target, &elf, slot)?);
                let (network, macs, bits) = (case.name, case.macs(), width.bits());
                let function = case.between_layers().map(Function::name);
                rows.push(Row { core: name, network, function, bits, instructions, macs, scratch, stack, code });
            }
        }
    }
    let mut shown = table(&["core", "network", "bits", "instructions", "per MAC", "scratch", "stack", "code"]);
    for row in &rows {
        shown.add_row([
            row.core.to_owned(),
            row.network.to_owned(),
            row.bits.to_string(),
            row.instructions.to_string(),
            format!("{:.3}", row.instructions as f64 / row.macs as f64),
            row.scratch.to_string(),
            row.stack.to_string(),
            row.code.to_string(),
        ]);
    }
    println!("{shown}");
    Ok(rows)
}

/// Returns the bytes of stack that a step takes, which the harness prints.
fn stack(target: Target, elf: &Path, slot: Option<&Path>) -> Result<u64> {
    let output = qemu::run(qemu::command_on(target, elf, slot, "stack")?, &[])?;
    let text = String::from_utf8_lossy(&output.stdout);
    let bytes = text.lines().find_map(|line| line.strip_prefix("stack ")?.parse().ok());
    bytes.with_context(|| format!("the harness has not measured its stack: {output:?}"))
}
