//! The command line.

pub(crate) mod link;
mod values;

use std::path::PathBuf;

use actq::methods::Method;
use actq::methods::actquant::choices::Choices;
use actq_kernels::Width;
use anyhow::ensure;
use clap::{Parser, Subcommand, ValueEnum, value_parser};

use link::{KeygenArgs, LinkArgs, SignArgs};
use values::{clock, forced, group, minutes, npz, pair, positive, rounds, size, width};

/// Quantizes robot policies to 2, 3, 4 or 8 bits and packs them into one image for a microcontroller.
///
/// Exit status: 0 on success, 1 on an error, 2 on a wrong command line, 128 + N if signal N ended the command (130 for
/// Ctrl-C). Long work shows its progress on standard error: a bar on a terminal, else a line every 10 s.
#[derive(Parser)]
#[command(name = "actq", version, max_term_width = 100)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Subcommand)]
pub(crate) enum Command {
    /// Make a policy's folder of an ONNX file
    ///
    /// Takes what PyTorch, rsl_rl, Brax, MuJoCo Playground, mjlab, Isaac Lab, Stable-Baselines3, CleanRL and ML-Agents
    /// export: matrix products, activations, norms, LSTM and GRU cells, convolutions over few positions, and what moves
    /// and scales values between them, with a batch of 1. docs/IMPORT.md lists what is taken, and what helps where
    /// something is not. The observation is the concatenation of the inputs, in the order that is printed. The action
    /// is the output that is called so, or the only one that can be; what does not lead to it is cut. What cannot be
    /// taken is refused by the node's name.
    ///
    /// Example: actq import model.onnx --out policies/walker --calib obs.npy --check
    Import(ImportArgs),
    /// Quantize a policy into an image
    ///
    /// POLICY_DIR holds policy.json (the op list), policy.safetensors (the weights) and, for every method but rtn, a
    /// recording to learn from: calib.npz or calib.safetensors with the arrays "obs" [episode, step, value] and
    /// optionally "action" (the network's raw output at each observation), "length" [episode] (valid steps) and "state"
    /// [episode, value] (recurrent state before the first step), or calib.npy with the observations alone. Two axes
    /// [frame, value] are one episode. Where heldout.npz, .npy or .safetensors is there too, the image is run on both,
    /// and errors and warnings are printed.
    ///
    /// An .onnx file stands for the folder that `actq import` makes of it, here and wherever a POLICY_DIR is taken; its
    /// recordings are those beside it.
    ///
    /// Example: actq quantize policies/ur3 --bits 3 --out ur3.actq
    /// Example: actq quantize model.onnx --calib obs.npy --bpw 2 --out model.actq
    Quantize(QuantizeArgs),
    /// Show what is in an image: operations, matrices, bits, memory, time on a Cortex-M4, the action contract
    ///
    /// Example: actq inspect ur3.actq --widths --stats ur3.json --svg ur3.svg
    Inspect(InspectArgs),
    /// Compare an image's actions with the f32 policy's on held-out observations
    ///
    /// The recording is heldout.npz, .npy or .safetensors in POLICY_DIR, or the file named. It holds "obs" and
    /// "action"; without "action", the policy in POLICY_DIR gives the actions. Also printed: how much of the error
    /// comes from rounding the activations, and, where calib.npz, .npy or .safetensors is there, a warning if the
    /// observations leave its range. With --driven, the error on the image's own path: where it has led a robot itself,
    /// which need not be where f32 leads.
    ///
    /// Example: actq eval ur3.actq --policy policies/ur3
    Eval(EvalArgs),
    /// Drive an image, record, and learn again
    ///
    /// Quantizes by method distill from the f32 policy's recordings. Then, every round, a command drives the newest image:
    /// a simulator or a robot that runs what the environment variable POLICY_CMD holds as its policy (actq serve IMAGE
    /// --record FILE, to be split as a shell does). The f32 policy labels what the image was shown, and the next image
    /// learns from all recordings together. The last image is driven, too. At the end: one image a row, with its error
    /// on the f32 policy's path, on its own, and how it drove.
    ///
    /// The command is run by sh -c, with ACTQ_ROUND = 1, 2, ... N + 1 (to drive other episodes each time) and
    /// ACTQ_POLICY (the policy's folder). What it prints goes to standard error; the last line that is one JSON object
    /// says how it went: success (a share), ci (its interval), episodes, and any other numbers.
    ///
    /// Example: actq tune policies/ur3 --bpw 1.5 --drive "ur3-drive --episodes 50" --rounds 3 --out ur3.actq
    Tune(TuneArgs),
    /// Compare methods at several budgets on held-out observations
    ///
    /// A cell of the table is the error (mean squared error / variance of the actions, mean over dimensions) and the
    /// true bits per weight, scales and padding counted; "-" where not even 2 bits fit. Every method uses its default
    /// groups; activations are int8, for distill int16 where it pays. A star marks the knee of a policy's best method.
    ///
    /// Example: actq sweep policies/ur3 policies/go1 --bpw 2.5,3,4 --svg errors.svg
    Sweep(SweepArgs),
    /// Run an image as a policy over standard input and output
    ///
    /// Little-endian: "R" resets and has no reply; "S" and the observation as f32 are answered by the action as f32.
    /// Where the observation, or a value inside the network, is not finite, every value of the answer is a NaN (bits
    /// 0x7fc00000): no action. The recurrent state and what was left of a chunk are forgotten, the last action is not:
    /// the step limit still counts from it.
    ///
    /// With --record, the observations go into a recording that `actq quantize --calib` learns from and
    /// `actq eval --driven` measures on, labelled by the f32 policy. "R" begins an episode, and so does what follows an
    /// answer without an action. The file is replaced as a whole while the policy runs: whenever the process ends, all
    /// but about the last twentieth is there. No file is ever overwritten.
    ///
    /// Example: actq serve ur3.actq --record drive.npz --policy policies/ur3
    Serve(ServeArgs),
    /// Talk to a motor controller: watch, arm, stream observations, send an image
    ///
    /// docs/LINK.md describes what goes over the wire, docs/SAFETY.md what the controller does.
    Link(LinkArgs),
    /// Make a key to sign images with
    ///
    /// The private key is written in PKCS #8 as PEM; the public one is printed, for builds that require signatures.
    Keygen(KeygenArgs),
    /// Sign an image and its version, for controllers that require it
    ///
    /// Example: actq sign ur3.actq --key fleet.pem --version 3 --out ur3.sig
    Sign(SignArgs),
}

#[derive(clap::Args)]
pub(crate) struct ImportArgs {
    /// The ONNX file; tensors in files beside it are read, too
    pub(crate) model: PathBuf,
    /// The policy's folder, which is made: policy.json, policy.safetensors and, with --calib, calib.npz
    #[arg(long, value_name = "POLICY_DIR")]
    pub(crate) out: PathBuf,
    /// A recording of observations to learn from: .npy, .npz or .safetensors
    #[arg(long, value_name = "FILE")]
    pub(crate) calib: Option<PathBuf>,
    /// The output that is the action, or any value of the graph [default: the one called action, or the only one]
    #[arg(long, value_name = "NAME")]
    pub(crate) output: Option<String>,
    /// An input that holds recurrent state, and the output of its next value; may be repeated [default: found by the
    /// cells]
    #[arg(long, value_name = "IN=OUT", value_parser = pair)]
    pub(crate) state: Vec<(String, String)>,
    /// Compare the actions with onnxruntime's on the recording, or on random observations: to 1e-5 of the largest
    /// action; where they differ, float64 says which is right. Needs Python with onnxruntime and onnx (python3, or what
    /// ACTQ_PYTHON names)
    #[arg(long)]
    pub(crate) check: bool,
    /// Replace files that are there
    #[arg(long)]
    pub(crate) force: bool,
}

#[derive(clap::Args)]
pub(crate) struct ServeArgs {
    /// The image
    pub(crate) image: PathBuf,
    /// Record what the policy is shown; where the file is there, FILE-2.npz and so on is taken
    #[arg(long, value_name = "FILE.npz", value_parser = npz)]
    pub(crate) record: Option<PathBuf>,
    /// The folder of the policy that the image was made from, which labels what is recorded [default: the image's
    /// folder, if that policy is there; else nothing is labelled]
    #[arg(long, value_name = "POLICY_DIR", env = "ACTQ_POLICY")]
    pub(crate) policy: Option<PathBuf>,
}

#[derive(clap::Args)]
pub(crate) struct QuantizeArgs {
    /// The policy's folder, or an .onnx file
    pub(crate) policy_dir: PathBuf,
    /// The image to write
    #[arg(long, value_name = "FILE")]
    pub(crate) out: PathBuf,
    /// A recording to learn from: .npz, .npy or .safetensors, or a folder of them; may be repeated [default: calib.* in
    /// POLICY_DIR]
    #[arg(long, value_name = "FILE|DIR")]
    pub(crate) calib: Vec<PathBuf>,
    /// Bits of every weight: 2, 3, 4 or 8 [default: 3]
    #[arg(long, value_name = "N", conflicts_with = "bpw", value_parser = width)]
    pub(crate) bits: Option<Width>,
    /// Bits per weight of the whole, scales and padding counted; each matrix gets a width
    #[arg(long, value_name = "X", value_parser = positive)]
    pub(crate) bpw: Option<f64>,
    /// Bytes of the whole image, as 98304, 96K or 1M (K is 1024 bytes, M is 1024 K)
    #[arg(long, value_name = "SIZE", conflicts_with_all = ["bits", "bpw"], value_parser = size)]
    pub(crate) flash: Option<usize>,
    /// The fewest bits whose error (NMSE, as eval measures it) is at most X, to a tenth of a bit per weight; measured
    /// on the held-out recording, else on that of calibration
    #[arg(long, value_name = "X", conflicts_with_all = ["bits", "bpw", "flash"], value_parser = positive)]
    pub(crate) max_nmse: Option<f64>,
    /// Milliseconds that a step may take on a Cortex-M4, predicted; takes the most bits that keep them
    #[arg(long, value_name = "X", conflicts_with_all = ["bits", "bpw", "flash", "max_nmse"], value_parser = positive)]
    pub(crate) ms: Option<f64>,
    /// The processor's clock for --ms, in Hz or as 168M
    // Without the conflicts, clap forgives a missing --ms where what is given conflicts with that.
    #[arg(
        long,
        value_name = "HZ",
        requires = "ms",
        conflicts_with_all = ["bits", "bpw", "flash", "max_nmse"],
        default_value = "168M",
        value_parser = clock
    )]
    pub(crate) clock: f64,
    /// Force the width of a matrix, by its tensor's name (method distill); may be repeated
    #[arg(long, value_name = "NAME=BITS", value_parser = forced)]
    pub(crate) width: Vec<(String, Width)>,
    /// Keep a matrix at 8 bits (method distill); may be repeated
    #[arg(long, value_name = "NAME")]
    pub(crate) protect: Vec<String>,
    /// Columns that share a u8 scale: 32, 64 or 128; 0 = one scale a row, which the kernels like best [default: 32 for
    /// rtn and actquant, 0 for gptq and distill]
    #[arg(long, value_name = "N", value_parser = group)]
    pub(crate) group: Option<usize>,
    /// Bits of the activations, whose scale is found at run time [default: for distill chosen per matrix, else 8]
    #[arg(long, value_name = "BITS")]
    pub(crate) activations: Option<ActivationArg>,
    /// How codes are chosen [default: distill where there is a recording to learn from, else rtn]
    #[arg(long)]
    pub(crate) method: Option<MethodArg>,
    #[command(flatten)]
    pub(crate) actquant: ActQuantArgs,
    #[command(flatten)]
    pub(crate) learn: LearnArgs,
    #[command(flatten)]
    pub(crate) run: RunArgs,
    /// Write the statistics and the allocation as JSON, for `actq inspect --stats`
    #[arg(long, value_name = "FILE")]
    pub(crate) save_stats: Option<PathBuf>,
}

#[derive(clap::Args)]
pub(crate) struct InspectArgs {
    /// The image
    pub(crate) image: PathBuf,
    /// The processor's clock, in Hz or as 168M
    #[arg(long, value_name = "HZ", default_value = "168M", value_parser = clock)]
    pub(crate) clock: f64,
    /// Print the predicted time of every operation and of the step as one JSON object
    #[arg(long, conflicts_with = "widths")]
    pub(crate) json: bool,
    /// Show instead which rows have which width
    #[arg(long)]
    pub(crate) widths: bool,
    /// What --save-stats wrote with this image: adds why rows have their widths, and the rows that were removed
    #[arg(long, value_name = "FILE", requires = "widths")]
    pub(crate) stats: Option<PathBuf>,
    /// Draw the widths
    #[arg(long, value_name = "FILE", requires = "widths")]
    pub(crate) svg: Option<PathBuf>,
}

#[derive(clap::Args)]
pub(crate) struct EvalArgs {
    /// The image
    pub(crate) image: PathBuf,
    /// The policy's folder, with the recordings
    #[arg(long, value_name = "POLICY_DIR", required_unless_present = "heldout")]
    pub(crate) policy: Option<PathBuf>,
    /// The held-out recording: .npz, .npy or .safetensors [default: the one in POLICY_DIR]
    #[arg(long, value_name = "FILE")]
    pub(crate) heldout: Option<PathBuf>,
    /// What this image was shown, as actq serve --record has recorded it, or a folder of that; may be repeated
    #[arg(long, value_name = "FILE|DIR")]
    pub(crate) driven: Vec<PathBuf>,
    /// Show no progress
    #[arg(long)]
    pub(crate) quiet: bool,
    /// Print one JSON object: nmse, worst_nmse, max_abs, steps, bpw, bytes; with --driven also own_nmse
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(clap::Args)]
pub(crate) struct TuneArgs {
    /// The policy's folder
    pub(crate) policy_dir: PathBuf,
    /// The last round's image
    #[arg(long, value_name = "FILE")]
    pub(crate) out: PathBuf,
    /// The command that drives an image
    #[arg(long, value_name = "COMMAND")]
    pub(crate) drive: String,
    /// How often is learned again
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = rounds)]
    pub(crate) rounds: usize,
    /// Bits per weight of the whole, scales and padding counted
    #[arg(long, value_name = "X", value_parser = positive)]
    pub(crate) bpw: Option<f64>,
    /// Bits of every weight: 2, 3, 4 or 8 [default: 3]
    #[arg(long, value_name = "N", conflicts_with = "bpw", value_parser = width)]
    pub(crate) bits: Option<Width>,
    /// A recording of the f32 policy: .npz, .npy or .safetensors, or a folder of them; may be repeated [default:
    /// calib.* in POLICY_DIR]
    #[arg(long, value_name = "FILE|DIR")]
    pub(crate) calib: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) learn: LearnArgs,
    /// Keep the images (round-0.actq, ...) and what each of them drove (round-0/drive.npz, ...) in this folder, which
    /// is made or empty
    #[arg(long, value_name = "DIR")]
    pub(crate) keep: Option<PathBuf>,
    /// Write the table, and all numbers that the command said
    #[arg(long, value_name = "FILE")]
    pub(crate) json: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) run: RunArgs,
}

#[derive(clap::Args)]
pub(crate) struct SweepArgs {
    /// The policies' folders
    #[arg(required = true)]
    pub(crate) policy_dirs: Vec<PathBuf>,
    /// Methods to compare
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "rtn,gptq,actquant,distill")]
    pub(crate) methods: Vec<MethodArg>,
    /// Bits per weight of the whole that are allowed
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "2,2.5,3,4", value_parser = positive)]
    pub(crate) bpw: Vec<f64>,
    /// A recording to learn from: .npz, .npy or .safetensors, or a folder of them; may be repeated [default: calib.* in
    /// POLICY_DIR]
    #[arg(long, value_name = "FILE|DIR")]
    pub(crate) calib: Vec<PathBuf>,
    /// The held-out recording to measure on [default: heldout.* in POLICY_DIR]
    #[arg(long, value_name = "FILE")]
    pub(crate) heldout: Option<PathBuf>,
    /// Draw error over bits, and mark the knee of the best method
    #[arg(long, value_name = "FILE")]
    pub(crate) svg: Option<PathBuf>,
    /// Write errors, bits, bytes, allocations and scores: an array with one object per policy
    #[arg(long, value_name = "FILE")]
    pub(crate) json: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) actquant: ActQuantArgs,
    #[command(flatten)]
    pub(crate) learn: LearnArgs,
    #[command(flatten)]
    pub(crate) run: RunArgs,
}

/// Where ActQuant may be read in several ways.
#[derive(clap::Args)]
pub(crate) struct ActQuantArgs {
    /// Choices of method actquant: KEY=VALUE,KEY=VALUE, or authors for all that its authors choose, which keys behind
    /// it alter
    ///
    /// [defaults in brackets; (authors) is what theirs is]
    ///
    /// bandwidth=[median]|squared(authors): the Gaussian kernels' sigma^2, or sigma, is the median squared distance.
    /// frames=N|all(authors) [512]: frames that HSIC is taken over, never more than 8192.
    /// score=[gain](authors)|output: a matrix's score is what it adds, F(output) - F(input), or F(output).
    /// noise=[codes]|format(authors): a width's expected error is 2^(-2 bits) with the bits of a code, or with all that
    /// it takes. widest=2|3|4(authors)|[8]: the widest codes that the allocation gives. head=[free]|2|3|4|8(authors):
    /// the width of the matrices that give the action. (The authors keep them at 16 bits.) samples=N|all(authors)
    /// [4096]: frames that the Fisher information is taken over, about. batch=N [1] (authors: 8): frames whose
    /// gradients are averaged before they are squared. signs=[random]|loss(authors): the loss's derivative where the
    /// recorded action is the policy's own: a random sign, or that of whatever difference there is.
    /// magnitude=[no]|yes(authors): fits of scales weigh by the importance, or by it times sqrt(mean of the row's w^2 +
    /// w^2).
    ///
    /// With one width for all (--bits), widths are not allocated, and only the last four keys count. docs/QUANTIZER.md
    /// has sources and reasons.
    ///
    /// Example: --method actquant --actquant authors,head=free
    #[arg(long, value_name = "CHOICES", verbatim_doc_comment)]
    actquant: Option<Choices>,
}

impl ActQuantArgs {
    /// These methods, actquant by these choices.
    pub(crate) fn of(&self, methods: &[Method]) -> anyhow::Result<Vec<Method>> {
        let choose = |&method| match (method, self.actquant) {
            (Method::ActQuant(_), Some(choices)) => Method::ActQuant(choices),
            (other, _) => other,
        };
        let methods: Vec<Method> = methods.iter().map(choose).collect();
        ensure!(
            self.actquant.is_none() || methods.iter().any(|method| matches!(method, Method::ActQuant(_))),
            "--actquant goes with method actquant, not with {}",
            methods.iter().map(Method::to_string).collect::<Vec<_>>().join(", ")
        );
        Ok(methods)
    }
}

/// How method distill learns. It ends by itself when the error no longer falls.
#[derive(clap::Args)]
pub(crate) struct LearnArgs {
    /// The most steps of distillation; 0 = none, but two-sided error feedback: seconds, and a larger error at few bits
    /// [default: by the number of weights, 20000 for 200 thousand, recurrent policies 7800, heads with denoising steps
    /// 10000]
    #[arg(long, value_name = "N")]
    pub(crate) steps: Option<usize>,
    /// The most minutes of distillation, instead of the default steps; what is learned then depends on the machine
    #[arg(long, value_name = "X", value_parser = minutes)]
    pub(crate) minutes: Option<f64>,
    /// Count errors relative to the action's size, more than feed-forward policies do by themselves. For a robot that
    /// holds its goal by small actions, which stays as far off as they are wrong: it gets closer, although the held-out
    /// error, in which wide movements count most, rises
    #[arg(long)]
    pub(crate) relative: bool,
}

/// What every quantization is run with.
#[derive(clap::Args)]
pub(crate) struct RunArgs {
    /// Seed of everything that is drawn
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,
    /// Threads to use, at most 256; no result depends on it [default: all cores]
    #[arg(long, value_name = "N", default_value_t = 0, hide_default_value = true, value_parser = value_parser!(u16).range(..=256))]
    pub(crate) threads: u16,
    /// Show no progress
    #[arg(long)]
    pub(crate) quiet: bool,
}

#[derive(Clone, Copy, ValueEnum)]
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
    /// Widths by HSIC scores, scales by the Fisher information of the actions (needs a recording with actions)
    Actquant,
    /// A width for every row, pruning, and distillation on the recorded observations (needs a recording)
    #[value(alias = "best")]
    Distill,
}

impl From<MethodArg> for Method {
    fn from(arg: MethodArg) -> Self {
        match arg {
            MethodArg::Rtn => Self::Rtn,
            MethodArg::Gptq => Self::Gptq,
            MethodArg::Actquant => Self::ActQuant(Choices::default()),
            MethodArg::Distill => Self::Distill,
        }
    }
}
