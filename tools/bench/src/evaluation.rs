//! The cost of one evaluation of a whole head on the target.

use std::path::Path;

use actq_boards::Target;
use actq_kernels::Image;
use anyhow::{Context as _, Result, ensure};

use crate::qemu::{self, Counter, Region, Server};

/// Evaluations before the counted one, so that the recurrent state differs from that after a reset.
pub const WARM_UP: usize = 4;

/// Serves `observations` from a reset with the harness at `elf` on a target's board under QEMU, with the image file at
/// `slot` in the slot or the built-in image. Counts one step that evaluates the network; for a head with chunks, one
/// that begins a chunk.
pub fn count(
    counter: &Counter,
    target: Target,
    elf: &Path,
    slot: Option<&Path>,
    image: &Image<'_>,
    mut observations: impl Iterator<Item = Vec<f32>>,
) -> Result<Region> {
    let mut command = qemu::command_on(target, elf, slot, "serve")?;
    counter.attach(&mut command, elf)?;
    let mut server = Server::start(command, image.act_len())?;
    server.reset()?;
    let steps = WARM_UP * image.execute() + 1;
    for _ in 0..steps {
        let mut observation = observations.next().context("too few recorded observations")?;
        // The recording's noise follows it; the head draws its own.
        observation.truncate(image.obs_len());
        server.step(&observation)?;
    }
    server.finish()?;
    let regions = counter.regions()?;
    ensure!(regions.len() == steps, "the counter counted {} of {steps} steps", regions.len());
    regions.into_iter().next_back().context("the counter counted no step")
}
