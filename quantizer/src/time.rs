//! Time on the target: what the cost model (`actq_kernels::cost`) says of an image at a clock.

use actq_kernels::Image;
use actq_kernels::cost::{self, Cost};
use actq_kernels::image::Op;
use anyhow::Result;
use serde::Serialize;

use crate::inspect::table;

/// Clock of the processor that is assumed where none is given: 168 MHz, that of an STM32F407.
pub const CLOCK: f64 = 168e6;

/// Reads a clock in Hz, as `168M`, `84000K` or `168000000`.
pub fn clock(text: &str) -> Result<f64, String> {
    let (digits, unit) = match text.char_indices().next_back() {
        Some((at, 'M' | 'm')) => (&text[..at], 1e6),
        Some((at, 'K' | 'k')) => (&text[..at], 1e3),
        _ => (text, 1.0),
    };
    let hertz = digits.parse().ok().map(|n: f64| n * unit).filter(|n| n.is_finite() && *n >= 1.0);
    hertz.ok_or_else(|| "a clock is a number of Hz, or of MHz with an M behind it".to_owned())
}

/// An operation's cost.
#[derive(Clone, Debug, Serialize)]
pub struct OpTime {
    /// The operation's name, as `actq inspect` has it.
    pub op: String,
    /// Values that it writes.
    pub output: usize,
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
        let time = |op: &str, output, macs, cost: Cost| OpTime {
            op: op.to_owned(),
            output,
            macs,
            instructions: cost.instructions,
            cycles: cost.cycles,
            microseconds: 1e6 * cost.cycles as f64 / clock_hz,
        };
        let of_op = |op: Op<'_>| {
            let (output, macs) = match op {
                Op::Linear { dst, matrix, .. } => (dst.len, matrix.rows * matrix.cols),
                _ => (cost::values(&op).2, 0),
            };
            time(crate::inspect::op_name(&op), output, macs, cost::of_op(&op))
        };
        let frame = time("step", image.act_len(), 0, cost::of_frame(image));
        let ops: Vec<OpTime> = image.ops().map(of_op).chain([frame]).collect();
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

    /// The table that `actq inspect` prints.
    pub fn report(&self) -> String {
        let mut rows = table(&["op", "output", "MACs", "instructions", "per MAC", "cycles", "per MAC", "us"]);
        let mut row = |op: &str, output: String, macs: usize, instructions: u64, cycles: u64, us: f64| {
            let per_mac = |n: u64| if macs == 0 { "-".to_owned() } else { format!("{:.3}", n as f64 / macs as f64) };
            let count = if macs == 0 { "-".to_owned() } else { macs.to_string() };
            rows.add_row([
                op.to_owned(),
                output,
                count,
                instructions.to_string(),
                per_mac(instructions),
                cycles.to_string(),
                per_mac(cycles),
                format!("{us:.1}"),
            ]);
        };
        for op in &self.ops {
            row(&op.op, op.output.to_string(), op.macs, op.instructions, op.cycles, op.microseconds);
        }
        row("all", String::new(), self.macs, self.instructions, self.cycles, 1e3 * self.milliseconds);
        format!(
            "{rows}\n\n\
             A step takes {:.3} ms at {} MHz, predicted for a Cortex-M4 with FPU and memory that never waits.\n\
             Polls of at least {} instructions take it in pieces.\n",
            self.milliseconds,
            self.clock_hz / 1e6,
            self.least_budget,
        )
    }
}
