//! The forms that a rival's weights are stored in, and what an image of a form takes.

use actq::budget::Budget;
use actq::emit;
use actq::emit::Core;
use actq::error::{Result, bail};
use actq::graph::{Graph, WeightMatrix};
use actq::measure::time::{CLOCK, StepTime};
use actq::methods::{Outcome, Quantized};
use actq::policy::Policy;
use actq::runtime::ImageBuffer;
use actq_kernels::Width;
use half::bf16;

/// Cycles of a multiplication in f32, an estimate in the rival's favour. It counts a word by VLDM, VMUL and VADD,
/// without a stall, a loop or a load of the operand. (A VFMA takes 3.)
pub const F32_CYCLES: f64 = 3.0;
/// Cycles of a MAC and of a row by CMSIS-NN's int8 kernel for fully connected layers (`arm_nn_vec_mat_mult_t_s8` with
/// DSP), an estimate in the rival's favour. An instruction takes at least a cycle, and these are the instructions that
/// were counted before this project began: together 2.07 per MAC for 256 x 256. A network of 189,952 weights took 2.45
/// (docs/records/2026-11-25-c.md), and this estimate has 2.11.
pub const CMSIS_NN_CYCLES: [f64; 2] = [1.875, 50.0];
/// A scale with which no function of an outlined network leaves f32's range.
const OUTLINED_SCALE: f32 = 1.0 / 1024.0;

/// The form of a network's weights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// 8 bits, a scale per row.
    Int8,
    /// 4 bits, a scale per row.
    Bits4,
    /// f32; no kernel here computes it.
    F32,
}

impl Form {
    /// Returns the width of the codes; `None` for f32.
    pub fn width(self) -> Option<Width> {
        match self {
            Self::Int8 => Some(Width::W8),
            Self::Bits4 => Some(Width::W4),
            Self::F32 => None,
        }
    }
}

/// Size and time of an image.
#[derive(Clone, Copy, Debug)]
pub struct Taken {
    /// Bytes of the weights: codes, padding, scales, output steps, block records.
    pub weights: usize,
    /// Bytes of the whole image. For f32, of an image as ours with 4 bytes per weight.
    pub image: usize,
    /// Predicted milliseconds of a step; for f32 an estimate ([`F32_CYCLES`]) of the products alone.
    pub milliseconds: f64,
}

/// Measures an image of this network, with the largest size that its vectors may have.
///
/// # Errors
///
/// As [`emit::image`].
pub fn taken(policy: &Policy, graph: &Graph, form: Form) -> Result<Taken> {
    let mut distinct = Policy { graph: graph.clone(), ..policy.clone() };
    let vectors = distinct.graph.nodes.iter_mut().flat_map(|node| node.kind.vectors_mut());
    // Equal constants share storage; learned ones are different.
    vectors.flatten().zip(1..).for_each(|(value, bits)| *value = f32::from_bits(bits));
    let beside = emit::bytes_beside_blocks(&distinct)?;
    let Some(width) = form.width() else {
        let weights = 4 * graph.weights();
        let macs: usize = graph.matrices.iter().enumerate().map(|(m, matrix)| graph.runs(m) * matrix.data.len()).sum();
        let milliseconds = 1e3 * F32_CYCLES * macs as f64 / CLOCK;
        return Ok(Taken { weights, image: beside + weights, milliseconds });
    };
    let outcomes: Vec<Outcome> = graph.matrices.iter().map(|matrix| outlined(matrix, width)).collect::<Result<_>>()?;
    let weights = outcomes.iter().map(Outcome::bytes).sum();
    let milliseconds = milliseconds(&Policy { graph: graph.clone(), ..policy.clone() }, &outcomes)?;
    Ok(Taken { weights, image: beside + weights, milliseconds })
}

/// Predicts the milliseconds of an image's step.
///
/// # Errors
///
/// As [`emit::image`].
pub fn milliseconds(policy: &Policy, outcomes: &[Outcome]) -> Result<f64> {
    let buffer = ImageBuffer::new(&emit::image(policy, outcomes)?);
    Ok(StepTime::new(&buffer.image("the rival's image".as_ref())?, Core::M4f, CLOCK).milliseconds)
}

/// Estimates the milliseconds of a step whose products are computed by CMSIS-NN ([`CMSIS_NN_CYCLES`]), all else as
/// here.
pub fn cmsis_nn_milliseconds(step: &StepTime) -> f64 {
    let [of_mac, of_row] = CMSIS_NN_CYCLES;
    let products = || step.ops.iter().filter(|op| op.macs > 0);
    let ours: u64 = products().map(|op| op.cycles).sum();
    let theirs: f64 = products().map(|op| of_mac * op.macs as f64 + of_row * (op.output * op.runs) as f64).sum();
    1e3 * ((step.cycles - ours) as f64 + theirs) / step.clock_hz
}

/// Returns codes of a matrix's shape.
fn outlined(matrix: &WeightMatrix, width: Width) -> Result<Outcome> {
    let quantized = Quantized {
        rows: matrix.rows,
        cols: matrix.cols,
        group: 0,
        widths: vec![Some(width); matrix.rows],
        scales: vec![bf16::from_f32(OUTLINED_SCALE); matrix.rows],
        group_scales: Vec::new(),
        codes: vec![0; matrix.rows * matrix.cols],
    };
    Ok(Outcome { x_max: quantized.x_max(127)?, quantized, error: None, allocation: None })
}

/// Limits on the size and time of an image.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Bytes of the weights.
    pub weights: f64,
    /// Bytes of the whole image.
    pub image: f64,
    /// Milliseconds of a step at [`CLOCK`].
    pub milliseconds: f64,
}

impl Limits {
    /// Returns the limits of a budget for a policy of this many weights.
    ///
    /// # Errors
    ///
    /// If the budget is a width or an error: a rival's size follows from bits, bytes or a time.
    pub fn of(budget: Budget, weights: usize) -> Result<Self> {
        let free = Self { weights: f64::INFINITY, image: f64::INFINITY, milliseconds: f64::INFINITY };
        Ok(match budget {
            Budget::BitsPerWeight(bits) => Self { weights: bits * weights as f64 / 8.0, ..free },
            Budget::ImageBytes(bytes) => Self { image: bytes as f64, ..free },
            Budget::Time(limit) => Self {
                image: limit.image_bytes.map_or(f64::INFINITY, |bytes| bytes as f64),
                milliseconds: limit.milliseconds * limit.clock_hz / CLOCK,
                ..free
            },
            Budget::Width(_) | Budget::MaxNmse(_) => {
                bail!("a narrower network needs a budget of bits per weight, bytes or milliseconds")
            }
        })
    }

    /// Returns `true` if all limits are kept.
    pub fn keep(&self, taken: Taken) -> bool {
        taken.weights as f64 <= self.weights
            && taken.image as f64 <= self.image
            && taken.milliseconds <= self.milliseconds
    }
}

#[cfg(test)]
mod tests {
    use actq::measure::time::OpTime;

    use super::*;

    #[test]
    fn cmsis_nn_replaces_the_products_alone() {
        let op = |macs, cycles| OpTime {
            op: "op".to_owned(),
            output: 2,
            runs: 3,
            macs,
            instructions: 0,
            cycles,
            microseconds: 0.0,
        };
        let step = StepTime {
            core: Core::M4f,
            clock_hz: 1e6,
            ops: vec![op(100, 150), op(0, 50)],
            macs: 100,
            instructions: 0,
            cycles: 200,
            milliseconds: 0.2,
            least_budget: 0,
        };
        assert!((cmsis_nn_milliseconds(&step) - (50.0 + 187.5 + 6.0 * 50.0) / 1e3).abs() < 1e-9);
    }
}
