//! The cost of the firmware's steps, polls and operations under QEMU.

use std::path::Path;

use actq_kernels::Image;
use actq_kernels::cost::Cost;
use anyhow::{Result, bail, ensure};

use crate::cycles::Code;
use crate::qemu::{self, Counter, Server};

/// Runs an image from the slot on observations, after one reset, and returns the cost of every counted region, and the
/// actions. `arguments` are the firmware's.
pub fn regions(
    elf: &Path,
    counter: &Counter,
    bytes: &[u8],
    arguments: &str,
    observations: &[Vec<f32>],
) -> Result<(Vec<Cost>, Vec<Vec<f32>>)> {
    let slot = qemu::slot(bytes)?;
    let buffer = actq::runtime::ImageBuffer::new(bytes);
    let image = buffer.image(slot.path())?;
    let mut command = qemu::command(elf, Some(slot.path()), arguments)?;
    counter.attach(&mut command, elf)?;
    let mut server = Server::start(command, image.act_len())?;
    let actions = observations.iter().map(|observation| server.step(observation)).collect::<Result<_>>()?;
    server.finish()?;
    let code = Code::read(elf)?;
    let cost = |region: &qemu::Region| -> Result<Cost> {
        Ok(Cost { instructions: region.instructions, cycles: code.cycles(region, 0)? })
    };
    Ok((counter.regions()?.iter().map(cost).collect::<Result<_>>()?, actions))
}

/// Measures the cost of whole steps.
pub fn steps(elf: &Path, counter: &Counter, bytes: &[u8], observations: &[Vec<f32>]) -> Result<Vec<Cost>> {
    Ok(regions(elf, counter, bytes, "serve", observations)?.0)
}

/// The parts of a step.
#[derive(Clone, Debug)]
pub struct Parts {
    /// `Head::begin`.
    pub begin: Cost,
    /// The operations.
    pub ops: Vec<Cost>,
    /// From the network's output to the action.
    pub action: Cost,
}

/// Measures every part of every step of an image that evaluates its network in each step, in polls of one operation
/// with `budget` instructions.
pub fn parts(
    elf: &Path,
    counter: &Counter,
    image: &Image<'_>,
    bytes: &[u8],
    observations: &[Vec<f32>],
    budget: u32,
) -> Result<Vec<Parts>> {
    ensure!(image.execute() == 1, "{} plays chunks; only one action per evaluation can be measured", image.name());
    let (costs, _) = regions(elf, counter, bytes, &format!("ops {budget}"), observations)?;
    let steps = costs.chunks(image.op_count() + 2);
    let parts = |step: &[Cost]| match step {
        [begin, ops @ .., action] if ops.len() == image.op_count() => {
            Ok(Parts { begin: *begin, ops: ops.to_vec(), action: *action })
        }
        _ => bail!("a step ended early"),
    };
    steps.map(parts).collect()
}
