//! The cost of the firmware's steps, polls and operations under QEMU.

use std::path::PathBuf;

use actq::runtime::ImageBuffer;
use actq_kernels::Image;
use actq_kernels::cost::Cost;
use anyhow::{Result, bail, ensure};

use crate::cycles::Code;
use crate::qemu::{self, Counter, Server};
use crate::{Target, firmware};

/// The firmware that serves an image, with what counts its instructions.
#[derive(Debug)]
pub struct Harness {
    target: Target,
    /// The firmware's ELF file.
    pub elf: PathBuf,
    counter: Counter,
    code: Code,
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

impl Harness {
    /// Builds the firmware for a target whose board has an image slot, and the counter.
    pub fn build(target: Target) -> Result<Self> {
        Self::of(target, firmware::harness(target)?)
    }

    /// Does the same as [`Self::build`] with a feature of the kernels.
    pub fn build_with(target: Target, feature: &'static str) -> Result<Self> {
        Self::of(target, firmware::harness_of(target, feature)?)
    }

    /// Builds the counter for a firmware of this target.
    pub fn of(target: Target, elf: PathBuf) -> Result<Self> {
        Ok(Self { target, counter: Counter::build()?, code: Code::of(target, &elf)?, elf })
    }

    /// Runs an image from the slot on observations, after one reset, and returns the cost of every counted region, and
    /// the actions. `arguments` are the firmware's.
    pub fn regions(
        &self,
        bytes: &[u8],
        arguments: &str,
        observations: &[Vec<f32>],
    ) -> Result<(Vec<Cost>, Vec<Vec<f32>>)> {
        let slot = qemu::slot(bytes)?;
        let buffer = ImageBuffer::new(bytes);
        let image = buffer.image(slot.path())?;
        let mut command = qemu::command_on(self.target, &self.elf, Some(slot.path()), arguments)?;
        self.counter.attach(&mut command, &self.elf)?;
        let mut server = Server::start(command, image.act_len())?;
        let actions = observations.iter().map(|observation| server.step(observation)).collect::<Result<_>>()?;
        server.finish()?;
        let cost = |region: &qemu::Region| -> Result<Cost> {
            Ok(Cost { instructions: region.instructions, cycles: self.code.cycles(region, 0)? })
        };
        Ok((self.counter.regions()?.iter().map(cost).collect::<Result<_>>()?, actions))
    }

    /// Measures the cost of whole steps.
    pub fn steps(&self, bytes: &[u8], observations: &[Vec<f32>]) -> Result<Vec<Cost>> {
        Ok(self.regions(bytes, "serve", observations)?.0)
    }

    /// Measures every part of every step of an image that evaluates its network in each step, in polls of one operation
    /// with `budget` instructions.
    pub fn parts(&self, image: &Image<'_>, bytes: &[u8], observations: &[Vec<f32>], budget: u32) -> Result<Vec<Parts>> {
        ensure!(image.execute() == 1, "{} plays chunks; only one action per evaluation can be measured", image.name());
        let (costs, _) = self.regions(bytes, &format!("ops {budget}"), observations)?;
        let steps = costs.chunks(image.op_count() + 2);
        let parts = |step: &[Cost]| match step {
            [begin, ops @ .., action] if ops.len() == image.op_count() => {
                Ok(Parts { begin: *begin, ops: ops.to_vec(), action: *action })
            }
            _ => bail!("a step ended early"),
        };
        steps.map(parts).collect()
    }
}
