//! Arguments of the commands for ONNX files and deploy bundles.

use std::path::PathBuf;

use actq::emit::Core;

use super::quantize::{BudgetArgs, LearnArgs, RunArgs};
use super::values::{LimitList, core, limits, pair, positive, two_files};

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
    /// An input that is measured anew in each step, although its name is that of a state or a constant; may be repeated
    #[arg(long, value_name = "NAME")]
    pub(crate) observe: Vec<String>,
    /// An input of keys or values that a host sends, as those of a large model (docs/POLICY.md); may be repeated. Attention
    /// reads them before the network's own
    #[arg(long, value_name = "NAME")]
    pub(crate) prefix: Vec<String>,
    /// The file has the network of a flow or a diffusion policy, which makes actions from noise: a JSON file of its steps,
    /// as {"kind": "flow", "steps": 10, "time": {"from": 0, "to": 1}} (docs/POLICY.md). The time and the iterate are the inputs
    /// of one value and of the output's length, or those that the keys time_input and iterate_input name
    #[arg(long, value_name = "FILE.json")]
    pub(crate) sampler: Option<PathBuf>,
    /// Actions in a second
    #[arg(long, value_name = "HZ", value_parser = positive)]
    pub(crate) rate_hz: Option<f64>,
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

/// Options for reading a deploy bundle, or that it shares with an ONNX file.
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
    /// Bundle: the profile of your own deploy stack, a TOML file of its keys, terms and rules
    #[arg(long, value_name = "FILE")]
    pub(crate) profile: Option<PathBuf>,
    /// Bundle: compare with a run of the deploy code, tick by tick, to 1e-5 of the largest value. RAW.npz has the raw
    /// inputs [tick, value] by name, EXPECT.npz the arrays observation, action and target
    #[arg(long, value_name = "RAW.npz:EXPECT.npz", value_parser = two_files)]
    pub(crate) reference: Option<(PathBuf, PathBuf)>,
    /// Lowest and highest value of all actions or targets, and the largest change in a second (which needs --rate-hz, and
    /// which a bundle does not take); or a file with a line for each of them. Of two limits, the stricter one holds. A motor
    /// controller refuses to arm without limits
    #[arg(long, value_name = "LOW:HIGH[:RATE]|FILE", value_parser = limits, allow_hyphen_values = true)]
    pub(crate) limits: Option<LimitList>,
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
    /// The checkout of actq to build the firmware in, for --board. Without it, the command that builds it is printed
    #[arg(long, value_name = "DIR", requires = "board")]
    pub(crate) sources: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) reading: ReadingArgs,
    /// A recording of raw values by `actq serve --record`, or a folder of them; may be repeated. Without one, the
    /// policy learns from RAW.npz
    #[arg(long, value_name = "FILE|DIR")]
    pub(crate) recordings: Vec<PathBuf>,
    /// Fail if a target's NMSE over the reference is above this number, 0.1 if it is not given
    #[arg(long, value_name = "NMSE", value_parser = positive, requires = "reference")]
    pub(crate) max_nmse: Option<f64>,
    #[command(flatten)]
    pub(crate) budget: BudgetArgs,
    /// The core to pack the image for: m0, m3, rv32imac, rv32zb, m4, m4f, m7, m33 or m55 [default: those with the DSP
    /// extension, m4 to m33]
    #[arg(long, value_name = "CORE", value_parser = core)]
    pub(crate) core: Option<Core>,
    #[command(flatten)]
    pub(crate) learn: LearnArgs,
    #[command(flatten)]
    pub(crate) run: RunArgs,
}

#[derive(clap::Args)]
pub(crate) struct CheckArgs {
    /// The image
    pub(crate) image: PathBuf,
    /// The raw inputs, and what the deploy code makes of them
    #[arg(long, value_name = "RAW.npz:EXPECT.npz", value_parser = two_files)]
    pub(crate) reference: (PathBuf, PathBuf),
    /// Fail if a target's NMSE is above this number, 0.1 if it is not given
    #[arg(long, value_name = "NMSE", value_parser = positive)]
    pub(crate) max_nmse: Option<f64>,
}
