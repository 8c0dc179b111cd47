//! The command line.

pub mod jobs;
pub(crate) mod link;
mod values;

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use actq::methods::{Effort, Method};
use actq_kernels::Width;
use anyhow::{Result, bail};
use clap::{Parser, Subcommand, ValueEnum};

use jobs::{JobArgs, MergeArgs, PlanArgs, PoolArgs};
use link::{KeygenArgs, LinkArgs, SignArgs};
use values::{
    clock, command, effort, forced, group, minutes, npz, pair, positive, rounds, seed, size, steps, threads, two_files,
    width,
};

/// Quantizes robot policies to 2, 3, 4 or 8 bits and packs them into one image for a microcontroller.
///
/// Exit status: 0 on success, 1 on an error, 2 on a wrong command line, 75 if the same job may succeed later, 128 + N if
/// signal N ended the command (130 for Ctrl-C). Long work shows its progress on standard error: a bar on a terminal, else a line every 10 s.
#[derive(Parser)]
#[command(name = "actq", version, max_term_width = 100)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Subcommand)]
pub(crate) enum Command {
    /// Convert an ONNX file to a policy folder, or a deploy bundle to a description
    ///
    /// Reads exports of PyTorch, rsl_rl, Brax, MuJoCo Playground, mjlab, Isaac Lab, Stable-Baselines3, CleanRL and
    /// ML-Agents: matrix products, activations, norms, LSTM and GRU cells, convolutions over few positions, and
    /// operators that move or scale values, with a batch of 1. docs/IMPORT.md lists the supported operators, and
    /// remedies for the others. The observation is the concatenation of the inputs, in the printed order. The action is
    /// the output named action, or else the only candidate. Nodes that do not lead to it are cut. An error names the
    /// node that cannot be imported.
    ///
    /// A deploy bundle is what a policy's authors publish for a robot: networks with files about joints, scales and
    /// histories. The command writes them as one file, deploy.toml (docs/DEPLOY.md), with copies of the networks. It
    /// asks for what the files do not say, and stops until --accept-profile or --answers gives it.
    ///
    /// Example: actq import model.onnx --out policies/walker --calib obs.npy --check
    ///
    /// Example: actq import bundle --accept-profile --reference raw.npz:expect.npz --out policies/walker
    Import(ImportArgs),
    /// Quantize a policy into an image
    ///
    /// POLICY_DIR holds policy.json (the op list), policy.safetensors (the weights) and, for every method but rtn, a
    /// recording to learn from: calib.npz or calib.safetensors with the arrays "obs" [episode, step, value] and
    /// optionally "action" (the network's raw output at each observation), "length" [episode] (valid steps) and "state"
    /// [episode, value] (recurrent state before the first step), or calib.npy with observations only. An array with two
    /// axes [frame, value] is one episode. If the folder also holds heldout.npz, .npy or .safetensors, the command runs
    /// the image on both recordings and prints errors and warnings.
    ///
    /// Every POLICY_DIR may also be an .onnx file. It is imported as `actq import` does, and its recordings are those
    /// beside it.
    ///
    /// Example: actq quantize policies/ur3 --bits 3 --out ur3.actq
    ///
    /// Example: actq quantize model.onnx --calib obs.npy --bpw 2 --out model.actq
    Quantize {
        #[command(flatten)]
        args: QuantizeArgs,
        /// The method that chooses the codes [default: distill if there is a calibration recording, else rtn]
        #[arg(long)]
        method: Option<MethodArg>,
    },
    /// Show an image: operations, matrices, bits, memory, predicted time on a Cortex-M4, action contract
    ///
    /// Example: actq inspect ur3.actq --widths --stats ur3.json --svg ur3.svg
    Inspect(InspectArgs),
    /// Compare an image's actions with the f32 policy's on held-out observations
    ///
    /// The recording is heldout.npz, .npy or .safetensors in POLICY_DIR, or the file that --heldout names. It holds
    /// "obs" and "action"; without "action", the policy in POLICY_DIR gives the actions. The report includes the share
    /// of the error that comes from rounding the activations. If POLICY_DIR holds calib.npz, .npy or .safetensors, the
    /// command warns when the observations leave its range. With --driven, the report adds the error on the image's own
    /// path: on observations that its own actions led to, which may differ from those of the f32 policy.
    ///
    /// Example: actq eval ur3.actq --policy policies/ur3
    Eval(EvalArgs),
    /// Turn a deploy bundle into an image and firmware, in one command that can be run again
    ///
    /// Imports the bundle into OUT/policy, compares it with --reference, quantizes it to OUT/policy.actq, compares the
    /// image with the reference, writes OUT/policy.h and OUT/policy.rs for the application, and builds OUT/BOARD.elf (in
    /// a checkout of actq, by `cargo xtask firmware`). Each step is a command of its own: import, quantize, check, constants. If one fails, run the command again: the description stays, which
    /// one may edit in between, and so does an image that was made with the same files and options.
    ///
    /// Example: actq deploy bundle --accept-profile --reference raw.npz:expect.npz --recordings runs --bpw 2 --out walker
    Deploy(DeployArgs),
    /// Write an image's sizes, names and places as constants of Rust, or of C
    ///
    /// The file has the lengths of observation and action, the control rate and the words of scratch memory. Of an image of
    /// a deploy bundle, it also has the place of each raw input and of each joint in the observation, and of the
    /// targets in the action. Names of a C header begin with the file's name: those of walker.h with WALKER_.
    ///
    /// Example: actq constants walker.actq --out walker.h
    Constants(ConstantsArgs),
    /// Write an image as source code of C, to be linked into a firmware
    ///
    /// OUT gets NAME.c with the image as a constant array, NAME.h with its lengths, names, scratch memory and digests
    /// as macros, and manifest.json with the SHA-256 of each file. docs/C.md tells how to build and run them.
    ///
    /// Example: actq export-c walker.actq --golden heldout.npz --out firmware/policy
    #[command(name = "export-c")]
    ExportC(ExportCArgs),
    /// Compare an image of a deploy bundle with a run of the deploy code
    ///
    /// Runs the image on the raw inputs of a reference and compares its targets, tick by tick: the error is that of the
    /// image's bits. RAW.npz has an array [tick, value] for each raw input that `actq inspect` lists; EXPECT.npz has
    /// the array target.
    ///
    /// Example: actq check walker.actq --reference raw.npz:expect.npz --max-nmse 0.05
    Check(CheckArgs),
    /// Quantize in on-policy rounds: roll out the image, record, and learn again (DAgger)
    ///
    /// Quantizes by method distill from the f32 policy's recordings. In every round a command rolls out the newest
    /// image: a simulator or a robot whose policy is the command line in the environment variable POLICY_CMD (actq
    /// serve IMAGE --record FILE, quoted for a shell). The f32 policy labels the recorded observations, and the next
    /// image learns from all recordings together. The last image is rolled out, too. At the end the command prints one
    /// row for each image: its error on the f32 policy's path and on its own path, and the outcome of its rollout.
    ///
    /// The command is run by sh -c, with ACTQ_ROUND = 1, 2, ... N + 1 (to run other episodes each time) and ACTQ_POLICY
    /// (the policy folder). Its output goes to standard error. The last line of it that is one JSON object reports the
    /// outcome: success (a share), ci (its interval), episodes, and any other numbers.
    ///
    /// Example: actq tune policies/ur3 --bpw 1.5 --drive "ur3-drive --episodes 50" --rounds 3 --out ur3.actq
    Tune(TuneArgs),
    /// Compare methods at several budgets on held-out observations
    ///
    /// A row of the table has an image's bytes, predicted milliseconds, error (NMSE: mean squared error / variance of the
    /// actions, mean over dimensions) and true bits per weight, with scales and padding; "-" if no image is within the
    /// budget. A star marks images of the frontier: no other image has fewer bytes and a smaller error. Every method uses
    /// its default group size. Activations are int8; method distill takes int16 for matrices that profit from it.
    ///
    /// Images and measurements are jobs. They run on this machine, each in a process, as many at a time as there are
    /// cores. With --store, results stay in that folder, and jobs whose results are there do not run again: the same
    /// command resumes after any interruption. Instead of policies, it takes one spec (SPEC.toml) or plan (the output of
    /// `actq plan`), which may have more: other budgets, seeds, closed-loop episodes. docs/SCALE.md documents specs and
    /// stores.
    ///
    /// Example: actq sweep policies/ur3 policies/go1 --bpw 2.5,3,4 --svg errors.svg
    ///
    /// Example: actq sweep sweep.toml --store results --svg errors.svg
    Sweep {
        #[command(flatten)]
        args: SweepArgs,
        /// Methods to compare [default: rtn,gptq,distill]
        #[arg(long, value_name = "LIST", value_delimiter = ',')]
        methods: Vec<MethodArg>,
    },
    /// Print the jobs of a sweep, one JSON object a line
    ///
    /// A job has a kind (quantize, evaluate, drive, learn, merge), options, the digests of its files, the addresses of the
    /// jobs that it needs (deps), and estimates: cpus, memory_mib, seconds. Its address is the SHA-256 of everything that
    /// its result depends on. A job of stage N needs only jobs of earlier stages. docs/SCALE.md documents specs.
    ///
    /// Example: actq plan sweep.toml > plan.jsonl
    Plan(PlanArgs),
    /// Run one job, and put its result into a store
    ///
    /// Does nothing if the store has the result. The result is whole or absent at every time, and does not depend on the
    /// machine or the number of threads. Exit status: 0 with a result; 75 or above 127 if another try may succeed (a full
    /// disk, a missing result of another job, a signal); 1 if none can.
    ///
    /// Example: sed -n 7p plan.jsonl | actq job - --store results
    Job(JobArgs),
    /// Print the results of a sweep: tables, the frontier and its plot
    ///
    /// Counts of episodes add up over the jobs of an image. A star marks images of the frontier: no other image has fewer
    /// bytes and a smaller error, or with closed-loop episodes more success.
    ///
    /// Example: actq merge sweep.toml --store results --svg frontier.svg
    Merge(MergeArgs),
    /// Run an image as a policy over standard input and output
    ///
    /// Little-endian: "R" resets and has no reply; the reply to "S" and an observation in f32 is the action in f32. If
    /// the observation or a value inside the network is not finite, every value of the reply is a NaN (bits
    /// 0x7fc00000): no action. The head then drops its recurrent state and the rest of its chunk. It keeps the last
    /// action, and the step limit still counts from it.
    ///
    /// With --record, the observations go into a recording that `actq quantize --calib` learns from and `actq eval
    /// --driven` measures on, labelled by the f32 policy. An episode begins at "R" and after a reply without an action.
    /// The command replaces the file as a whole while the policy runs: a process that is killed loses about the last
    /// twentieth. It never overwrites a file of an earlier run.
    ///
    /// Example: actq serve ur3.actq --record drive.npz --policy policies/ur3
    Serve(ServeArgs),
    /// Talk to a motor controller: watch, arm, stream observations, send an image
    ///
    /// docs/LINK.md documents the link protocol, docs/SAFETY.md the controller's behaviour.
    Link(LinkArgs),
    /// Generate a key that signs images
    ///
    /// Writes the private key as PKCS #8 in PEM. Prints the public key, for firmware that requires signatures.
    Keygen(KeygenArgs),
    /// Sign an image and its version, for controllers that require signatures
    ///
    /// Example: actq sign ur3.actq --key fleet.pem --version 3 --out ur3.sig
    Sign(SignArgs),
}

#[derive(clap::Args)]
pub(crate) struct ImportArgs {
    /// The ONNX file, with its external tensors beside it; or a deploy bundle: a folder, a .kinfer file, or an ONNX
    /// file with one of the options for bundles
    pub(crate) model: PathBuf,
    /// The policy folder to create: policy.json, policy.safetensors and, with --calib, calib.npz
    #[arg(long, value_name = "POLICY_DIR")]
    pub(crate) out: PathBuf,
    /// The calibration recording: .npy, .npz or .safetensors; of a bundle: raw inputs [tick, value] by name, .npz
    #[arg(long, value_name = "FILE")]
    pub(crate) calib: Option<PathBuf>,
    /// The output that is the action, or any value of the graph [default: the output named action, or the only
    /// candidate]
    #[arg(long, value_name = "NAME")]
    pub(crate) output: Option<String>,
    /// An input that holds recurrent state, and the output of its next value; may be repeated [default: the states of
    /// the LSTM and GRU cells]
    #[arg(long, value_name = "IN=OUT", value_parser = pair)]
    pub(crate) state: Vec<(String, String)>,
    /// Compare the actions with onnxruntime's, on the recording or on random observations, to 1e-5 of the largest
    /// action. If they differ, a run in float64 decides which is right. Needs Python with onnxruntime and onnx
    /// (python3, or the interpreter that ACTQ_PYTHON names)
    #[arg(long)]
    pub(crate) check: bool,
    #[command(flatten)]
    pub(crate) reading: ReadingArgs,
    /// Replace existing files
    #[arg(long)]
    pub(crate) force: bool,
}

/// Options for reading a deploy bundle.
#[derive(clap::Args, Clone)]
pub(crate) struct ReadingArgs {
    /// Bundle: the answers to the questions of an earlier run, a TOML file of their keys
    #[arg(long, value_name = "FILE")]
    pub(crate) answers: Option<PathBuf>,
    /// Bundle: ask for what nothing states, line by line on standard input
    #[arg(long)]
    pub(crate) ask: bool,
    /// Bundle: accept what the family's deploy code says where the files say nothing
    #[arg(long)]
    pub(crate) accept_profile: bool,
    /// Bundle: compare with a run of the deploy code, tick by tick, to 1e-5 of the largest value. RAW.npz has the raw
    /// inputs [tick, value] by name, EXPECT.npz the arrays observation, action and target
    #[arg(long, value_name = "RAW.npz:EXPECT.npz", value_parser = two_files)]
    pub(crate) reference: Option<(PathBuf, PathBuf)>,
}

#[derive(clap::Args)]
pub(crate) struct ServeArgs {
    /// The image
    pub(crate) image: PathBuf,
    /// Record the observations; if the file exists, the recording is FILE-2.npz, FILE-3.npz and so on
    #[arg(long, value_name = "FILE.npz", value_parser = npz)]
    pub(crate) record: Option<PathBuf>,
    /// The folder of the policy that the image was made from; that policy labels the recording [default: the image's
    /// folder, if it holds that policy; else the recording has no labels]
    #[arg(long, value_name = "POLICY_DIR", env = "ACTQ_POLICY")]
    pub(crate) policy: Option<PathBuf>,
}

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
    #[command(flatten)]
    pub(crate) budget: BudgetArgs,
    /// The largest error (NMSE, as eval measures it): searches the fewest bits that keep it, to a tenth of a bit per
    /// weight. It is measured on the held-out recording, or else on the calibration recording
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
    /// Bits of every weight: 2, 3, 4 or 8 [default: 3]
    #[arg(long, value_name = "N", conflicts_with = "bpw", value_parser = width)]
    pub(crate) bits: Option<Width>,
    /// Bits per weight of all weights, with scales and padding; each matrix gets a width
    #[arg(long, value_name = "X", value_parser = positive)]
    pub(crate) bpw: Option<f64>,
    /// The most bytes of the image, as 98304, 96K or 1M (K is 1024 bytes, M is 1024 K)
    #[arg(long, value_name = "SIZE", conflicts_with_all = ["bits", "bpw"], value_parser = size)]
    pub(crate) flash: Option<usize>,
    /// The most milliseconds of a step on a Cortex-M4, as predicted; with --flash, both are kept
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

#[derive(clap::Args)]
pub(crate) struct InspectArgs {
    /// The image
    pub(crate) image: PathBuf,
    /// The processor's clock, in Hz or as 168M
    #[arg(long, value_name = "HZ", default_value = "168M", value_parser = clock, conflicts_with = "widths")]
    pub(crate) clock: f64,
    /// Print the predicted time of every operation and of the step as one JSON object
    #[arg(long, conflicts_with = "widths")]
    pub(crate) json: bool,
    /// Show the width of every row instead
    #[arg(long)]
    pub(crate) widths: bool,
    /// The statistics that --save-stats wrote with this image: adds the reasons for the widths, and the removed rows
    #[arg(long, value_name = "FILE", requires = "widths")]
    pub(crate) stats: Option<PathBuf>,
    /// Draw the widths as SVG
    #[arg(long, value_name = "FILE", requires = "widths")]
    pub(crate) svg: Option<PathBuf>,
}

#[derive(clap::Args)]
pub(crate) struct EvalArgs {
    /// The image
    pub(crate) image: PathBuf,
    /// The policy folder, with the recordings
    #[arg(long, value_name = "POLICY_DIR", required_unless_present = "heldout")]
    pub(crate) policy: Option<PathBuf>,
    /// The held-out recording: .npz, .npy or .safetensors [default: the one in POLICY_DIR]
    #[arg(long, value_name = "FILE")]
    pub(crate) heldout: Option<PathBuf>,
    /// A recording of this image's own rollout, by actq serve --record, or a folder of them; may be repeated
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
pub(crate) struct DeployArgs {
    /// The bundle: a folder, a .kinfer file, or an ONNX file with metadata
    pub(crate) bundle: PathBuf,
    /// The folder to write to
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// The board to build firmware for; `cargo xtask firmware --list` shows them
    #[arg(long, value_name = "NAME")]
    pub(crate) board: Option<String>,
    #[command(flatten)]
    pub(crate) reading: ReadingArgs,
    /// A recording of raw values by `actq serve --record`, or a folder of them; may be repeated. Without one, the policy
    /// learns from RAW.npz
    #[arg(long, value_name = "FILE|DIR")]
    pub(crate) recordings: Vec<PathBuf>,
    /// Fail if a target's NMSE over the reference is above this number
    #[arg(long, value_name = "NMSE", value_parser = positive, requires = "reference")]
    pub(crate) max_nmse: Option<f64>,
    #[command(flatten)]
    pub(crate) budget: BudgetArgs,
    #[command(flatten)]
    pub(crate) learn: LearnArgs,
    #[command(flatten)]
    pub(crate) run: RunArgs,
}

#[derive(clap::Args)]
pub(crate) struct ConstantsArgs {
    /// The image
    pub(crate) image: PathBuf,
    /// The file to write: .rs for a module of Rust, .h for a header of C and C++
    #[arg(long, value_name = "FILE")]
    pub(crate) out: PathBuf,
    /// A deploy.toml, whose [gains] are added
    #[arg(long, value_name = "FILE")]
    pub(crate) gains: Option<PathBuf>,
}

#[derive(clap::Args)]
pub(crate) struct ExportCArgs {
    /// The image
    pub(crate) image: PathBuf,
    /// The folder for the files; created if it does not exist
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Prefix of the files and of the names in them
    #[arg(long, default_value = "policy")]
    pub(crate) name: String,
    /// A recording: also write NAME_golden.c, its first observations with the bits of this host's actions, which a
    /// board must give too
    #[arg(long, value_name = "FILE")]
    pub(crate) golden: Option<PathBuf>,
    /// Observations of the golden run, at most
    #[arg(long, default_value = "100", value_name = "N", requires = "golden", value_parser = steps)]
    pub(crate) steps: NonZeroUsize,
}

#[derive(clap::Args)]
pub(crate) struct CheckArgs {
    /// The image
    pub(crate) image: PathBuf,
    /// The raw inputs, and what the deploy code makes of them
    #[arg(long, value_name = "RAW.npz:EXPECT.npz", value_parser = two_files)]
    pub(crate) reference: (PathBuf, PathBuf),
    /// Fail if a target's NMSE is above this number
    #[arg(long, value_name = "NMSE", value_parser = positive)]
    pub(crate) max_nmse: Option<f64>,
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
    /// Bits per weight of all weights, with scales and padding
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

/// Arguments of `actq sweep`, without the methods.
#[derive(clap::Args, Debug)]
pub struct SweepArgs {
    /// The policy folders; or one spec or plan, with --store
    #[arg(required = true)]
    pub(crate) policy_dirs: Vec<PathBuf>,
    /// Budgets, in bits per weight of all weights [default: 2,2.5,3,4]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = positive)]
    pub(crate) bpw: Vec<f64>,
    /// A calibration recording: .npz, .npy or .safetensors, or a folder of them; may be repeated [default: calib.* in
    /// POLICY_DIR]
    #[arg(long, value_name = "FILE|DIR")]
    pub(crate) calib: Vec<PathBuf>,
    /// The held-out recording to measure on [default: heldout.* in POLICY_DIR]
    #[arg(long, value_name = "FILE")]
    pub(crate) heldout: Option<PathBuf>,
    /// The processor's clock for predicted times, in Hz or as 168M [default: 168M]
    #[arg(long, value_name = "HZ", value_parser = clock)]
    pub(crate) clock: Option<f64>,
    /// Draw errors, success and the frontiers over bytes and over predicted milliseconds as SVG, and mark the knee of the
    /// best method
    #[arg(long, value_name = "FILE")]
    pub(crate) svg: Option<PathBuf>,
    /// Write bytes, cycles, errors, bits, allocations and scores as JSON
    #[arg(long, value_name = "FILE")]
    pub(crate) json: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) distill: DistillArgs,
    #[command(flatten)]
    pub(crate) run: RunArgs,
    #[command(flatten)]
    pub(crate) pool: PoolArgs,
}

impl SweepArgs {
    /// Returns `true` if a spec or plan is given instead of policies.
    pub fn has_spec(&self) -> bool {
        self.spec().is_some()
    }

    /// Returns the spec or plan that is given instead of policies.
    pub(crate) fn spec(&self) -> Option<&Path> {
        let is_spec = |path: &&PathBuf| path.extension().is_some_and(|ending| ending == "toml" || ending == "jsonl");
        self.policy_dirs.iter().find(is_spec).map(PathBuf::as_path)
    }

    /// Names the given options that a spec has keys for.
    pub(crate) fn of_a_spec(&self) -> Vec<&'static str> {
        let Self { bpw, calib, heldout, clock, distill: DistillArgs { effort, steps, relative }, run, .. } = self;
        let given = [
            ("--bpw", !bpw.is_empty()),
            ("--calib", !calib.is_empty()),
            ("--heldout", heldout.is_some()),
            ("--clock", clock.is_some()),
            ("--effort", *effort != Effort::Default),
            ("--steps", steps.is_some()),
            ("--relative", *relative),
            ("--seed", run.seed != 1),
        ];
        given.into_iter().filter(|(_, is_given)| *is_given).map(|(name, _)| name).collect()
    }
}

/// Options of distillation, which also ends when the error no longer falls.
#[derive(clap::Args, Clone, Debug)]
pub(crate) struct LearnArgs {
    #[command(flatten)]
    pub(crate) distill: DistillArgs,
    /// The most minutes of distillation, instead of the default steps; the image then depends on the machine's speed
    #[arg(long, value_name = "X", value_parser = minutes, conflicts_with = "effort")]
    pub(crate) minutes: Option<f64>,
}

/// Options of distillation by which an image does not depend on the machine.
#[derive(clap::Args, Clone, Debug)]
pub(crate) struct DistillArgs {
    /// How long to learn: quick (an eighth of the steps), default, or thorough (2.5 times the steps)
    #[arg(long, value_name = "E", default_value = "default", value_parser = effort, conflicts_with = "steps")]
    pub(crate) effort: Effort,
    /// The most steps of distillation; 0 = two-sided error feedback instead, which takes seconds and gives a larger
    /// error at few bits [default: by the number of weights, 8000 for 200 thousand, recurrent policies 4000, heads
    /// with denoising steps 5000]
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
