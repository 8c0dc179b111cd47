//! The memory of the application on each board, and the cost of a head on each core.

use std::path::Path;

use actq::measure::eval;
use actq::runtime::ImageBuffer;
use actq_bench::controller::{Controller, act, wait_until};
use actq_bench::qemu::Counter;
use actq_bench::stack::worst_case;
use actq_bench::{Target, evaluation, firmware, ur3};
use anyhow::{Context, Result, ensure};

/// Bytes of flash of the application without its image.
pub(crate) const FLASH: &str = "bytes of flash, application on ";
/// Bytes of RAM of the application without its scratch memory: variables, and the most stack.
pub(crate) const RAM: &str = "bytes of RAM, application on ";
/// Bytes of stack, computed only from the ELF file.
const STACK: &str = "bytes of stack at most, application on ";
const STEP: &str = "instructions of an evaluation, ur3_reach at 3 bits, rounded, on ";

/// Steps of the application before the test reads its stack: chunks of several evaluations.
const STEPS: usize = 20;

/// Boards of the application, each with `true` if the analysis of its stack follows its code.
const BOARDS: [(Target, bool); 8] = [
    (Target::Fpu, true),
    (Target::M33, true),
    (Target::M7, true),
    (Target::NoDsp, true),
    (Target::M55, true),
    (Target::V6m, true),
    (Target::Riscv, false),
    (Target::F405, true),
];

/// Measures all figures, by name.
pub(crate) fn measure(counter: &Counter) -> Result<Vec<(String, u64)>> {
    let path = firmware::built_in()?;
    let buffer = ImageBuffer::read(path)?;
    let image = buffer.image(path)?;
    let recorded = eval::heldout(&ur3(), &image)?;
    let mut figures = Vec::new();
    for (target, is_bounded) in BOARDS {
        let name = target.board().name;
        let elf = firmware::controller(target, "")?;
        let harness = firmware::harness(target)?;
        let step = evaluation::count(counter, target, &harness, None, &image, recorded.episode(0))?;
        figures.push((format!("{FLASH}{name}"), firmware::flash_bytes(&elf)? - image.bytes() as u64));
        figures.push((format!("{STEP}{name}"), step.instructions));
        if !is_bounded {
            continue;
        }
        // The used stack depends on when interrupts come. It is no figure; it must stay below the bound.
        let used = stack(target, &elf, recorded.episode(0))?;
        let worst = worst_case(&elf)?;
        let (stack, room) = (worst.bytes().into(), worst.room.into());
        ensure!(
            used <= stack && stack <= room,
            "{name}: used {used} bytes of stack; the computed maximum is {stack}, the reserved room {room}"
        );
        let scratch = target.board().application.context("the board has no application")?.scratch;
        figures.push((format!("{RAM}{name}"), firmware::ram_bytes(&elf)? - 4 * scratch as u64 + stack));
        figures.push((format!("{STACK}{name}"), stack));
    }
    Ok(figures)
}

/// Measures the bytes of stack that the application has used after some steps.
fn stack(target: Target, elf: &Path, observations: impl Iterator<Item = Vec<f32>>) -> Result<u64> {
    let controller = Controller::start(target, elf, None)?;
    let mut client = controller.client()?;
    for observation in observations.take(STEPS) {
        act(&mut client, &observation)?;
    }
    // The firmware looks at its stack periodically.
    let ticks = client.status()?.ticks;
    wait_until(&mut client, "later", |status| status.ticks.wrapping_sub(ticks) > 300)?;
    Ok(client.timing()?.stack.into())
}
