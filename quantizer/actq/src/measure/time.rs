//! Time on the target: what the cost model (`actq_kernels::pace::cost`) says of an image at a clock.

use actq_kernels::Image;
use actq_kernels::image::Op;
use actq_kernels::pace::cost::{self, Cost};
use serde::Serialize;

/// Clock of the processor that is assumed where none is given: 168 MHz, that of an STM32F405.
pub const CLOCK: f64 = 168e6;

/// An operation's cost.
#[derive(Clone, Debug, Serialize)]
pub struct OpTime {
    /// The operation's name, as `actq inspect` has it.
    pub op: String,
    /// Values that it writes.
    pub output: usize,
    /// How often it runs; everything below is of all its runs.
    pub runs: usize,
    /// Multiplications of a weight; 0 where the operation has no weights.
    pub macs: usize,
    /// Instructions.
    pub instructions: u64,
    /// Modelled cycles.
    pub cycles: u64,
    /// At the clock.
    pub microseconds: f64,
}

/// The cost of a step that evaluates the network, on a Cortex-M4 with FPU.
#[derive(Clone, Debug, Serialize)]
pub struct StepTime {
    /// The processor's clock.
    pub clock_hz: f64,
    /// The operations, and last what a step takes beside them.
    pub ops: Vec<OpTime>,
    /// Of the whole step.
    pub macs: usize,
    /// Of the whole step.
    pub instructions: u64,
    /// Of the whole step.
    pub cycles: u64,
    /// Of the whole step.
    pub milliseconds: f64,
    /// The least budget of a poll, in instructions ([`actq_kernels::Head::poll`]).
    pub least_budget: u32,
}

impl StepTime {
    /// Predicts the cost of a step.
    pub fn new(image: &Image<'_>, clock_hz: f64) -> Self {
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
            time(op.kind.name(), op.dst().len, runs, runs * macs, cost::of_op(&op) * runs as u64)
        };
        let frame = time("step", image.act_len(), 1, 0, cost::of_frame(image));
        let ops: Vec<OpTime> = image.ops().enumerate().map(of_op).chain([frame]).collect();
        let Cost { instructions, cycles } = cost::of_step(image);
        Self {
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
