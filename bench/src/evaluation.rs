//! What one evaluation of a whole head costs on the target.

use std::path::Path;

use actq_boards::Target;
use actq_kernels::Image;
use anyhow::{Context as _, Result, ensure};

use crate::qemu::{self, Counter, Region, Server};

/// Evaluations before the one that is counted, so that recurrent state is none that a reset leaves.
const WARM_UP: usize = 4;

/// Serves `observations` from a reset with the harness at `elf` on a target's board under QEMU, with the image file at
/// `slot` in the slot or the built-in image; counts one step that evaluates the network, of a chunked head one that
/// begins a chunk.
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
        // Behind it stands the noise of a recording; the head draws its own.
        observation.truncate(image.obs_len());
        server.step(&observation)?;
    }
    server.finish()?;
    let regions = counter.regions()?;
    ensure!(regions.len() == steps, "the counter saw {} steps of {steps}", regions.len());
    regions.into_iter().next_back().context("nothing was counted")
}
