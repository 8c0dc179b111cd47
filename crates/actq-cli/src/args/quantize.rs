//! Arguments of the commands that quantize a policy.

use std::path::PathBuf;

use actq::budget::{Budget, TimeLimit};
use actq::emit::Core;
use actq::methods::{Effort, Method};
use actq_kernels::Width;
use anyhow::{Result, bail};
use clap::ValueEnum;

use super::values::{
    clock, command, core, effort, forced, group, minutes, positive, rounds, seed, size, threads, width,
};

/// Arguments of `actq quantize`, without the method.
#[derive(clap::Args, Debug)]
pub struct QuantizeArgs {
    /// The policy folder, or an .onnx file
    pub(crate) policy_dir: PathBuf,
    /// The image to write
    #[arg(long, value_name = "FILE")]
    pub(crate) out: PathBuf,
    /// A calibration recording: .npz, .npy or .safetensors, or a folder of them; may be repeated [default: calib.* in
    /// POLICY_DIR]
    #[arg(long, value_name = "FILE|DIR")]
    pub(crate) calib: Vec<PathBuf>,
    /// The held-out recording to measure on [default: heldout.* in POLICY_DIR, else parts of the calibration recording
    /// in turn, which takes 1 to 2.5 times as long as making the image]
    #[arg(long, value_name = "FILE")]
    pub(crate) heldout: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) budget: BudgetArgs,
    /// The largest error (NMSE, as eval measures it): searches the fewest bits that keep it, to a tenth of a bit per
    /// weight. It is measured on the held-out recording, or else on held-out parts of the calibration recording
    #[arg(long, value_name = "X", conflicts_with_all = ["bits", "bpw", "flash", "ms", "clock"], value_parser = positive)]
    pub(crate) max_nmse: Option<f64>,
    /// Force the width of a matrix, by its tensor's name (method distill); may be repeated
    #[arg(long, value_name = "NAME=BITS", value_parser = forced)]
    pub(crate) width: Vec<(String, Width)>,
    /// Keep a matrix at 8 bits (method distill); may be repeated
    #[arg(long, value_name = "NAME")]
    pub(crate) protect: Vec<String>,
    /// Group size, the columns that share a u8 scale: 32, 64 or 128; 0 = one scale for each row, the fastest in the
    /// kernels [default: 32 for rtn, 0 for gptq and distill]
    #[arg(long, value_name = "N", value_parser = group)]
    pub(crate) group: Option<usize>,
    /// Bits of the activations, whose scale is computed at run time [default: method distill chooses for each matrix,
    /// else 8]
    #[arg(long, value_name = "BITS")]
    pub(crate) activations: Option<ActivationArg>,
    /// The core to pack the image for: m0, m3, rv32imac, rv32zb, m4, m4f, m7, m33 or m55 [default: those with the DSP
    /// extension, m4 to m33]
    #[arg(long, value_name = "CORE", value_parser = core)]
    pub(crate) core: Option<Core>,
    #[command(flatten)]
    pub(crate) learn: LearnArgs,
    #[command(flatten)]
    pub(crate) run: RunArgs,
    /// Write the statistics and the allocation as JSON, for `actq inspect --stats`
    #[arg(long, value_name = "FILE")]
    pub(crate) save_stats: Option<PathBuf>,
}

/// Budget of an image.
#[derive(clap::Args, Clone, Debug)]
pub(crate) struct BudgetArgs {
    /// Bits of every weight: 2, 3, 4 or 8 [default: 3; distill divides as many bytes among the rows]
    #[arg(long, value_name = "N", conflicts_with = "bpw", value_parser = width)]
    pub(crate) bits: Option<Width>,
    /// Bits per weight of all weights, with scales and padding; each matrix gets a width
    #[arg(long, value_name = "X", value_parser = positive)]
    pub(crate) bpw: Option<f64>,
    /// The most bytes of the image, as 98304, 96K or 1M (K is 1024 bytes, M is 1024 K)
    #[arg(long, value_name = "SIZE", conflicts_with_all = ["bits", "bpw"], value_parser = size)]
    pub(crate) flash: Option<usize>,
    /// The most milliseconds of a step, as predicted, on the core of --core or a Cortex-M4; with --flash, both are kept
    #[arg(long, value_name = "X", conflicts_with_all = ["bits", "bpw"], value_parser = positive)]
    pub(crate) ms: Option<f64>,
    /// The processor's clock for --ms, in Hz or as 168M
    // Without the conflicts, clap accepts a missing --ms if a given option conflicts with --ms.
    #[arg(
        long,
        value_name = "HZ",
        requires = "ms",
        conflicts_with_all = ["bits", "bpw"],
        default_value = "168M",
        value_parser = clock
    )]
    pub(crate) clock: f64,
}

impl BudgetArgs {
    /// Returns the budget of an image for a core; `None` if none is given.
    pub(crate) fn budget(&self, core: Option<Core>) -> Option<Budget> {
        let Self { bits, bpw, flash, ms, clock } = *self;
        let limits = [
            bits.map(Budget::Width),
            bpw.map(Budget::BitsPerWeight),
            ms.map(|milliseconds| {
                let core = core.unwrap_or(Core::M4f);
                Budget::Time(TimeLimit { milliseconds, core, clock_hz: clock, image_bytes: flash })
            }),
            flash.map(Budget::ImageBytes),
        ];
        limits.into_iter().flatten().next()
    }
}

#[derive(clap::Args)]
pub(crate) struct TuneArgs {
    /// The policy folder
    pub(crate) policy_dir: PathBuf,
    /// The file to write the last round's image to
    #[arg(long, value_name = "FILE")]
    pub(crate) out: PathBuf,
    /// The command that rolls out an image
    #[arg(long, value_name = "COMMAND", value_parser = command)]
    pub(crate) drive: String,
    /// On-policy rounds, 1 to 100
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = rounds)]
    pub(crate) rounds: usize,
    #[command(flatten)]
    pub(crate) budget: BudgetArgs,
    /// A recording of the f32 policy: .npz, .npy or .safetensors, or a folder of them; may be repeated [default:
    /// calib.* in POLICY_DIR]
    #[arg(long, value_name = "FILE|DIR")]
    pub(crate) calib: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) learn: LearnArgs,
    /// Keep the images (round-0.actq, ...) and the recordings of their rollouts (round-0/drive.npz, ...) in this
    /// folder, which must be new or empty
    #[arg(long, value_name = "DIR")]
    pub(crate) keep: Option<PathBuf>,
    /// Write the table and all numbers that the command printed, as JSON
    #[arg(long, value_name = "FILE")]
    pub(crate) json: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) run: RunArgs,
}

/// Options of distillation, which also ends when the error no longer falls.
#[derive(clap::Args, Clone, Debug)]
pub(crate) struct LearnArgs {
    #[command(flatten)]
    pub(crate) distill: DistillArgs,
    /// The most minutes of distillation, instead of the default steps; half of them measure the error if no recording is
    /// held out. The image then depends on the machine's speed
    #[arg(long, value_name = "X", value_parser = minutes, conflicts_with = "effort")]
    pub(crate) minutes: Option<f64>,
}

/// Options of distillation by which an image does not depend on the machine.
#[derive(clap::Args, Clone, Debug)]
pub(crate) struct DistillArgs {
    /// Length of learning: quick (an eighth of the steps), default, or thorough (2.5 times the steps)
    #[arg(long, value_name = "E", default_value = "default", value_parser = effort, conflicts_with = "steps")]
    pub(crate) effort: Effort,
    /// The most steps of distillation; 0 = two-sided error feedback, which takes seconds and gives a larger error at
    /// few bits [default: by the number of weights, 8000 for 200 thousand, recurrent policies 4000, heads with
    /// denoising steps 5000]
    #[arg(long, value_name = "N")]
    pub(crate) steps: Option<usize>,
    /// Weigh errors relative to the action's size, more than is the default for feed-forward policies. Use it for a
    /// robot that holds its goal by small actions: it gets closer to the goal. The held-out error rises, as wide
    /// movements count most in it
    #[arg(long)]
    pub(crate) relative: bool,
}

/// Options of every quantization.
#[derive(clap::Args, Clone, Debug)]
pub(crate) struct RunArgs {
    /// Seed of all random numbers
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = seed)]
    pub(crate) seed: u64,
    /// Threads, at most 256, 0 for the default; results do not depend on their number [default: all cores]
    #[arg(long, value_name = "N", default_value_t = 0, hide_default_value = true, value_parser = threads)]
    pub(crate) threads: u16,
    /// Show no progress
    #[arg(long)]
    pub(crate) quiet: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum ActivationArg {
    /// int8
    #[value(name = "8")]
    Int8,
    /// int16
    #[value(name = "16")]
    Int16,
}

#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum MethodArg {
    /// Round to nearest
    Rtn,
    /// Column-wise error feedback with the inputs' second moment (needs a recording)
    Gptq,
    /// A width for every row, pruning, and distillation on the recorded observations (needs a recording)
    #[value(alias = "best")]
    Distill,
    /// Part of `actq-research`
    #[value(hide = true)]
    Actquant,
}

impl MethodArg {
    /// Returns the method; refuses actquant, which another command has.
    pub(crate) fn method(self) -> Result<Method> {
        Ok(match self {
            Self::Rtn => Method::Rtn,
            Self::Gptq => Method::Gptq,
            Self::Distill => Method::Distill,
            Self::Actquant => bail!(
                "method actquant is not part of this command; give the same arguments to `cargo run --release -p actq-research --` \
                 in the sources of actq"
            ),
        })
    }
}
