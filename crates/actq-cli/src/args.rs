//! The command line.

mod deploy;
mod image;
pub mod jobs;
pub(crate) mod link;
mod quantize;
mod sweep;
mod values;

use clap::{Parser, Subcommand};

pub(crate) use deploy::{CheckArgs, DeployArgs, ImportArgs, ReadingArgs};
pub(crate) use image::{ConstantsArgs, EvalArgs, ExportCArgs, InspectArgs, RepackArgs, ReportArgs, ServeArgs};
use jobs::{JobArgs, MergeArgs, PlanArgs};
use link::{KeygenArgs, LinkArgs, SignArgs};
pub use quantize::QuantizeArgs;
pub(crate) use quantize::{ActivationArg, DistillArgs, LearnArgs, MethodArg, TuneArgs};
pub use sweep::SweepArgs;

/// The commands by what they are for; a test compares them with [`Command`].
const HELP: &str = "\
{before-help}{about-with-newline}
{usage-heading} {usage}

Make an image:
  import     Convert an ONNX file to a policy folder, or a deploy bundle to a description
  quantize   Quantize a policy into an image
  tune       Quantize in on-policy rounds: roll out the image, record, and learn again (DAgger)

Check it:
  inspect    Show an image: operations, matrices, bits, memory, predicted time, action contract
  eval       Compare an image's actions with the f32 policy's on held-out observations
  report     Write an image's report as a web page, in which the image runs
  check      Compare an image of a deploy bundle with a run of the deploy code
  serve      Run an image as a policy over standard input and output

Put it on a robot:
  deploy     Turn a deploy bundle into an image and firmware, in one command that can be run again
  constants  Write an image's sizes, names and places as constants of Rust, or of C
  export-c   Write an image as source code of C, to be linked into a firmware
  repack     Convert an image to the layouts of another core: the same weights, the same actions
  link       Talk to a motor controller: watch, arm, stream observations, send an image
  keygen     Generate a key that signs images
  sign       Sign an image and its version, for controllers that require signatures

Compare many:
  sweep      Compare methods at several budgets on held-out observations
  plan       Print the jobs of a sweep, one JSON object a line
  job        Run one job, and put its result into a store
  merge      Print the results of a sweep: tables and the frontier

Options:
{options}{after-help}";
const EXAMPLE: &str = "Example: actq quantize model.onnx --calib obs.npy --bpw 2 --out model.actq\n\n`actq COMMAND --help` explains a command, with examples.";

/// Quantizes robot policies to 2, 3, 4 or 8 bits and packs them into one image for a microcontroller.
///
/// Exit status: 0 on success, 1 on an error, 2 on a wrong command line, 75 if the same job may succeed later, 128 + N
/// if signal N ended the command (130 for Ctrl-C). Long work shows its progress on standard error: a bar on a terminal,
/// else a line every 10 s.
#[derive(Parser)]
#[command(name = "actq", version, max_term_width = 100, help_template = HELP, after_help = EXAMPLE)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Subcommand)]
pub(crate) enum Command {
    /// Convert an ONNX file to a policy folder, or a deploy bundle to a description
    ///
    /// Reads exports of PyTorch, rsl_rl, Brax, MuJoCo Playground, mjlab, Isaac Lab, Stable-Baselines3, CleanRL and
    /// ML-Agents. They may contain matrix products, activations, norms, LSTM and GRU cells, convolutions over few
    /// positions, and operators that move or scale values, with a batch of 1. docs/IMPORT.md lists the supported
    /// operators, and remedies for the others. The observation is the concatenation of the inputs, in the printed
    /// order. The action is the output named action, or else the only candidate. Nodes that do not lead to it are cut.
    /// An error names the node that cannot be imported.
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
    /// recording to learn from. The recording is calib.npz or calib.safetensors, or calib.npy with observations only.
    /// Its arrays are "obs" [episode, step, value] and optionally "action" (the network's raw output at each
    /// observation), "length" [episode] (valid steps) and "state" [episode, value] (recurrent state before the first
    /// step). An array with two axes [frame, value] is one episode. If the folder also holds heldout.npz, .npy or
    /// .safetensors, the command runs the image on both recordings and prints errors and warnings.
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
    /// Example: actq inspect ur3.actq --widths --stats ur3.json
    Inspect(InspectArgs),
    /// Write an image's report as a web page, in which the image runs
    ///
    /// The file needs no network: pictures of the network and of the flash, errors by layer and by action, and the image
    /// itself, compiled to WebAssembly, with a slider for each value of the observation. --policy adds the f32 policy beside
    /// it. For an image of a deploy bundle, --recordings are files with an array [tick, value] for each raw input.
    ///
    /// Example: actq report ur3.actq --policy policies/ur3 --stats ur3.json --out ur3.html
    Report(ReportArgs),
    /// Convert an image to the layouts of another core: the same weights, the same actions
    ///
    /// Cores with the DSP extension (m4, m4f, m7, m33), with Helium (m55, also for Cortex-M85) and without both (m0, m3,
    /// rv32imac, rv32zb) have layouts of their own. A core runs images of the others slowly, or refuses them if its build lacks their layouts.
    ///
    /// Example: actq repack ur3.actq --core m3 --out ur3-m3.actq
    Repack(RepackArgs),
    /// Compare an image's actions with the f32 policy's on held-out observations
    ///
    /// The recording is heldout.npz, .npy or .safetensors in POLICY_DIR, or the file that --heldout names. It holds
    /// "obs" and "action"; without "action", the policy in POLICY_DIR gives the actions. The report includes the share
    /// of the error that comes from rounding the activations. If POLICY_DIR holds calib.npz, .npy or .safetensors, the
    /// command warns when the observations leave its range. With --driven, the report adds the error on the image's own
    /// path. Its own actions led to these observations, which may differ from those of the f32 policy.
    ///
    /// Example: actq eval ur3.actq policies/ur3
    Eval(EvalArgs),
    /// Turn a deploy bundle into an image and firmware, in one command that can be run again
    ///
    /// Imports the bundle into OUT/policy, compares it with --reference, quantizes it to OUT/policy.actq, and compares
    /// the image with the reference. Writes OUT/policy.h and OUT/policy.rs for the application, and with --board builds
    /// OUT/BOARD.elf, by `cargo xtask firmware` in the checkout that --sources names. Each step is a command of its
    /// own: import, quantize, check, constants. If one fails, run the command again. It keeps the description, which
    /// you may edit in between, and an image that was made with the same files and options.
    ///
    /// Without --steps, --effort and --minutes, learning takes at most 6 minutes, so that the image depends on the
    /// machine's speed. Pass --steps or --effort for the same image on every machine.
    ///
    /// Example: actq deploy bundle --accept-profile --reference raw.npz:expect.npz --recordings runs --bpw 2 --out
    /// walker
    Deploy(DeployArgs),
    /// Write an image's sizes, names and places as constants of Rust, or of C
    ///
    /// The file has the lengths of observation and action, the control rate and the words of scratch memory. For a
    /// deploy bundle's image, it also has the places of raw inputs and joints in the observation, and of the targets in
    /// the action. Names of a C header begin with the file's name: those of walker.h with WALKER_.
    ///
    /// Example: actq constants walker.actq --out walker.h
    Constants(ConstantsArgs),
    /// Write an image as source code of C, to be linked into a firmware
    ///
    /// OUT gets NAME.c with the image as a constant array, NAME.h with its lengths, names, scratch memory and digests
    /// as macros, and NAME.json with the SHA-256 of each file. It replaces only files of an earlier export. docs/C.md
    /// documents how to build and run them.
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
    /// image, in a simulator or on a robot. Its policy is the command line in the environment variable POLICY_CMD (actq
    /// serve IMAGE --record FILE, quoted for a shell). The f32 policy labels the recorded observations, and the next
    /// image learns from all recordings together. The last image is rolled out, too. At the end the command prints one
    /// row for each image, with its errors on the f32 policy's path and on its own path, and the outcome of its
    /// rollout.
    ///
    /// The command is run by sh -c, with ACTQ_ROUND = 1, 2, ... N + 1 (to run other episodes each time) and ACTQ_POLICY
    /// (the policy folder). Its output goes to standard error. The last line of it that is one JSON object reports the
    /// outcome: success (a share), ci (its interval), episodes, and any other numbers.
    ///
    /// Example: actq tune policies/ur3 --bpw 1.5 --drive "ur3-drive --episodes 50" --rounds 3 --out ur3.actq
    Tune(TuneArgs),
    /// Compare methods at several budgets on held-out observations
    ///
    /// A row of the table has an image's bytes, predicted milliseconds, error and true bits per weight, with scales and
    /// padding. The error is the NMSE: mean squared error / variance of the actions, mean over dimensions. The row has
    /// "-" if no image is within the budget. A star marks images of the frontier: no other image has fewer bytes and a
    /// smaller error. Every method uses its default group size. Activations are int8; method distill takes int16 for
    /// matrices that profit from it.
    ///
    /// Images and measurements are jobs. They run on this machine, each in a process, as many at a time as there are
    /// cores. With --store, results stay in that folder, and jobs whose results are there do not run again: the same
    /// command resumes after any interruption. Instead of policies, it takes one spec (SPEC.toml) or plan (the output
    /// of `actq plan`), which may have more: other budgets, seeds, closed-loop episodes. docs/SCALE.md documents specs
    /// and stores.
    ///
    /// Example: actq sweep policies/ur3 policies/go1 --bpw 2.5,3,4
    ///
    /// Example: actq sweep sweep.toml --store results
    Sweep {
        #[command(flatten)]
        args: SweepArgs,
        /// Methods to compare [default: rtn,gptq,distill]
        #[arg(long, value_name = "LIST", value_delimiter = ',')]
        methods: Vec<MethodArg>,
    },
    /// Print the jobs of a sweep, one JSON object a line
    ///
    /// A job has a kind (quantize, evaluate, drive, learn, merge), options, the digests of its files, the addresses of
    /// the jobs that it needs (deps), and estimates: cpus, memory_mib, seconds. Its address is the SHA-256 of
    /// everything that its result depends on. A job of stage N needs only jobs of earlier stages. docs/SCALE.md
    /// documents specs.
    ///
    /// Example: actq plan sweep.toml > plan.jsonl
    Plan(PlanArgs),
    /// Run one job, and put its result into a store
    ///
    /// Does nothing if the store has the result. The result is whole or absent at every time, and does not depend on
    /// the machine or the number of threads. Exit status: 0 with a result; 75 or above 127 if another try may succeed
    /// (a full disk, a missing result of another job, a signal); 1 if none can.
    ///
    /// Example: sed -n 7p plan.jsonl | actq job - --store results
    Job(JobArgs),
    /// Print the results of a sweep: tables and the frontier
    ///
    /// Counts of episodes add up over the jobs of an image. A star marks images of the frontier: no other image has
    /// fewer bytes and a smaller error, or with closed-loop episodes more success.
    ///
    /// Example: actq merge sweep.toml --store results --json frontier.json
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
    /// The command replaces the file as a whole while the policy runs: a process that is killed by signal 9 loses about
    /// the last twentieth, or up to 256 frames of a short recording; other signals lose none. It never overwrites a file
    /// of an earlier run.
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

#[cfg(test)]
mod tests {
    use clap::CommandFactory as _;

    use super::*;

    #[test]
    fn the_help_lists_every_command_once() {
        let listed = |name: &str| HELP.lines().filter(|line| line.split_whitespace().next() == Some(name)).count();
        for command in Cli::command().get_subcommands() {
            assert_eq!(listed(command.get_name()), usize::from(!command.is_hide_set()), "{}", command.get_name());
        }
        assert_eq!(
            HELP.lines().filter(|line| line.starts_with("  ")).count(),
            Cli::command().get_subcommands().count()
        );
    }
}
