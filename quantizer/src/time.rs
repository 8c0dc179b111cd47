//! Time on the target: what the cost model (`actq_kernels::cost`) says of an image at a clock.

use std::path::Path;

use actq_kernels::Image;
use actq_kernels::cost::{self, Cost};
use actq_kernels::image::Op;
use anyhow::{Context, Result, ensure};
use serde::Serialize;

use crate::inspect::table;
use crate::policy::Policy;
use crate::quantize::prepared::Prepared;
use crate::quantize::{Activations, Budget, BudgetTooSmall, Options, Outcome};
use crate::runtime::ImageBuffer;
use crate::writer;

/// Clock of the processor that is assumed where none is given: 168 MHz, that of an STM32F405.
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
            let macs = op.matrix().map_or(0, |matrix| matrix.rows * matrix.cols);
            time(crate::inspect::op_name(&op), op.dst().len, macs, cost::of_op(&op))
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
            "{rows}\n\n{}Polls of at least {} instructions take it in pieces.\n",
            self.sentence(),
            self.least_budget
        )
    }

    /// The time of the step, as a sentence.
    pub fn sentence(&self) -> String {
        format!(
            "A step takes {:.3} ms at {} MHz, predicted for a Cortex-M4 with FPU and memory that never waits.\n",
            self.milliseconds,
            self.clock_hz / 1e6
        )
    }
}

/// The largest number of milliseconds that a step may take, at a clock.
#[derive(Clone, Copy, Debug)]
pub struct Limit {
    /// Milliseconds.
    pub milliseconds: f64,
    /// The processor's clock in Hz.
    pub clock_hz: f64,
}

/// More bits than any image takes.
const MOST_BITS: f64 = 10.0;
/// Tries between the least and the most bits; the last two differ by a hundredth of a bit.
const TRIES: usize = 10;

impl Limit {
    /// The predicted time of an image's step.
    pub fn predict(&self, bytes: &[u8]) -> Result<StepTime> {
        let buffer = ImageBuffer::new(bytes);
        Ok(StepTime::new(&buffer.image(Path::new("the new image"))?, self.clock_hz))
    }

    fn milliseconds_of(&self, policy: &Policy, outcomes: &[Outcome]) -> Result<f64> {
        Ok(self.predict(&writer::image(policy, outcomes)?)?.milliseconds)
    }

    /// Quantizes with the most bits per weight whose step keeps the limit; `options.budget` does not count.
    ///
    /// The bits are found with int8 activations (where the options do not ask for int16) and without learning, on which no time
    /// depends; then the policy is quantized once. Activations that the method would rather have in int16 are, as far as the
    /// time allows. Returns the options with that budget, too. `progress` gets the share done.
    pub fn quantize(
        &self,
        prepared: &Prepared<'_>,
        options: &Options,
        mut progress: impl FnMut(f64),
    ) -> Result<(Policy, Vec<Outcome>, Options)> {
        let limit = self.milliseconds;
        let activations = match options.activations {
            Activations::Auto => Activations::Int8,
            given => given,
        };
        let draft = Options { activations, steps: Some(1), ..options.clone() };
        let with =
            |bits: f64| prepared.quantize(&Options { budget: Budget::BitsPerWeight(bits), ..draft.clone() }, |_| {});
        let time = |bits: f64| with(bits).and_then(|(policy, outcomes)| self.milliseconds_of(&policy, &outcomes));
        let (mut low, mut high) = (least_bits(with(f64::MIN_POSITIVE))?, MOST_BITS);
        let fastest = time(low)?;
        ensure!(
            fastest <= limit,
            "{limit} ms are allowed, but the fastest is {fastest:.3} ms at {} MHz, with {low:.3} bits a weight",
            self.clock_hz / 1e6
        );
        if time(high)? <= limit {
            low = high;
        }
        for _ in 0..TRIES {
            let middle = 0.5 * (low + high);
            if time(middle)? <= limit {
                low = middle;
            } else {
                high = middle;
            }
        }
        let chosen = Options { budget: Budget::BitsPerWeight(low), ..options.clone() };
        let (policy, mut outcomes) = prepared.quantize(&chosen, &mut progress)?;
        // Back to int8, the largest matrix first.
        let mut wide: Vec<usize> = (0..outcomes.len()).filter(|&m| outcomes[m].x_max > activations.limit()).collect();
        wide.sort_by_key(|&m| outcomes[m].quantized.codes.len());
        while self.milliseconds_of(&policy, &outcomes)? > limit {
            let m = wide.pop().context("the step takes longer than was predicted before learning")?;
            outcomes[m].x_max = outcomes[m].quantized.x_max(activations.limit())?;
        }
        Ok((policy, outcomes, chosen))
    }
}

/// The fewest bits per weight that a method takes, from its refusal of almost none.
fn least_bits<T>(refused: Result<T>) -> Result<f64> {
    match refused {
        Ok(_) => Ok(f64::MIN_POSITIVE),
        Err(error) => match error.downcast_ref::<BudgetTooSmall>() {
            // A little more, so that the division's rounding does not count.
            Some(least) => Ok((1.0 + 1e-9) * 8.0 * least.bytes as f64 / least.weights.max(1) as f64),
            None => Err(error),
        },
    }
}
