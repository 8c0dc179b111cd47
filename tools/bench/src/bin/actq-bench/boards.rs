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

/// Measures all figures, by name.
pub(crate) fn measure(counter: &Counter) -> Result<Vec<(String, u64)>> {
    let path = firmware::built_in()?;
    let buffer = ImageBuffer::read(path)?;
    let image = buffer.image(path)?;
    let recorded = eval::heldout(&ur3(), &image)?;
    let mut figures = Vec::new();
    for target in [Target::Fpu, Target::M33, Target::M7, Target::NoDsp, Target::F405] {
        let board = target.board();
        let scratch = board.application.context("the board has no application")?.scratch;
        let elf = firmware::controller(target, "")?;
        // The used stack depends on when interrupts come. It is no figure; it must stay below the bound.
        let used = stack(target, &elf, recorded.episode(0))?;
        let worst = worst_case(&elf)?;
        let (stack, room) = (worst.bytes().into(), worst.room.into());
        ensure!(
            used <= stack && stack <= room,
            "{}: used {used} bytes of stack; the computed maximum is {stack}, the reserved room {room}",
            board.name
        );
        let harness = firmware::harness(target)?;
        let step = evaluation::count(counter, target, &harness, None, &image, recorded.episode(0))?;
        let ram = firmware::ram_bytes(&elf)? - 4 * scratch as u64 + stack;
        for (what, figure) in [
            (FLASH, firmware::flash_bytes(&elf)? - image.bytes() as u64),
            (RAM, ram),
            (STACK, stack),
            (STEP, step.instructions),
        ] {
            figures.push((format!("{what}{}", board.name), figure));
        }
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
