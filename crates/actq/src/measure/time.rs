//! Predicted time on the target: the cost model (`actq_kernels::cost`) at a clock.

use actq_kernels::Image;
use actq_kernels::cost::{Core, Cost};
use actq_kernels::image::Op;
use serde::Serialize;

/// Default clock of the processor in Hz: 168 MHz, that of an STM32F405.
pub const CLOCK: f64 = 168e6;

/// An operation's cost.
#[derive(Clone, Debug, Serialize)]
pub struct OpTime {
    /// Name of the operation, as `actq inspect` shows it.
    pub op: String,
    /// Values that it writes.
    pub output: usize,
    /// Runs in a step; all figures below cover all runs.
    pub runs: usize,
    /// MACs; 0 if the operation has no weights.
    pub macs: usize,
    /// Instructions.
    pub instructions: u64,
    /// Modelled cycles.
    pub cycles: u64,
    /// Microseconds at the clock.
    pub microseconds: f64,
}

/// The cost of a step that evaluates the network, on a core. It is known if the core
/// [has the image's layouts](Core::has_layouts_of).
#[derive(Clone, Debug, Serialize)]
pub struct StepTime {
    /// The core.
    #[serde(serialize_with = "crate::budget::core_name::serialize")]
    pub core: Core,
    /// The processor's clock in Hz.
    pub clock_hz: f64,
    /// Operations, and last the rest of a step.
    pub ops: Vec<OpTime>,
    /// MACs of the whole step.
    pub macs: usize,
    /// Instructions of the whole step.
    pub instructions: u64,
    /// Modelled cycles of the whole step.
    pub cycles: u64,
    /// Milliseconds of the whole step at the clock.
    pub milliseconds: f64,
    /// Least slice budget of a poll, in instructions ([`actq_kernels::Head::poll`]).
    pub least_budget: u32,
}

impl StepTime {
    /// Predicts the cost of a step.
    pub fn new(image: &Image<'_>, core: Core, clock_hz: f64) -> Self {
        let rates = core.rates();
        let time = |op: &str, output, runs, macs, cost: Cost| OpTime {
            op: op.to_owned(),
            output,
            runs,
            macs,
            instructions: cost.instructions,
            cycles: cost.cycles,
            microseconds: 1e6 * cost.cycles as f64 / clock_hz,
        };
        let of_op = |(i, op): (usize, Op<'_>)| {
            let runs = if i < image.first_denoising_op() { 1 } else { image.denoising_steps() };
            let macs = op.matrix().map_or(0, |matrix| matrix.rows * matrix.cols);
            time(op.kind.name(), op.dst().len, runs, runs * macs, rates.of_op(&op) * runs as u64)
        };
        let frame = time("step", image.act_len(), 1, 0, rates.of_frame(image));
        let ops: Vec<OpTime> = image.ops().enumerate().map(of_op).chain([frame]).collect();
        let Cost { instructions, cycles } = rates.of_step(image);
        Self {
            core,
            clock_hz,
            macs: ops.iter().map(|op| op.macs).sum(),
            ops,
            instructions,
            cycles,
            milliseconds: 1e3 * cycles as f64 / clock_hz,
            least_budget: image.least_budget(),
        }
    }
}
