//! The command `actq`.
#![forbid(unsafe_code)]

use std::io::{self, Write as _};
use std::path::PathBuf;
use std::process::ExitCode;

use actq::graph::Graph;
use actq::inspect::{group_name, report, table};
use actq::policy::Policy;
use actq::quantize::actquant::Statistics;
use actq::quantize::prepared::Prepared;
use actq::quantize::{Activations, Budget, Method, Options, Outcome};
use actq::runtime::ImageBuffer;
use actq::time::{self, StepTime};
use actq::{eval, serve, sweep, writer};
use actq_kernels::Width;
use anyhow::{Context, Result};
use clap::{Parser, Subcommand, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};

/// Quantizes robot policies to 2, 3, 4 or 8 bits and packs them into one image for a microcontroller.
///
/// Exit status: 0 on success, 1 on an error, 2 on a wrong command line.
#[derive(Parser)]
#[command(name = "actq", version, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Quantize a policy into an image
    ///
    /// POLICY_DIR holds policy.json (the op list), policy.safetensors (the weights) and, for every method but rtn, calib.npz
    /// (recorded observations: array "obs" [episode, step, value], optionally "length" [episode]).
    ///
    /// Example: actq quantize policies/ur3 --bits 3 --out ur3.actq
    Quantize(QuantizeArgs),
    /// Show what is in an image: operations, matrices, bits, memory, time on a Cortex-M4, the action contract
    Inspect {
        /// The image
        image: PathBuf,
        /// The processor's clock, in Hz or as 168M
        #[arg(long, value_name = "HZ", default_value = "168M", value_parser = time::clock)]
        clock: f64,
        /// Print the predicted time of every operation and of the step as one JSON object
        #[arg(long)]
        json: bool,
    },
    /// Compare an image's actions with the recorded f32 actions of heldout.npz
    Eval {
        /// The image
        image: PathBuf,
        /// The folder with heldout.npz
        #[arg(long, value_name = "POLICY_DIR")]
        policy: PathBuf,
        /// Print one JSON object: nmse, worst_nmse, max_abs, steps, bpw, bytes
        #[arg(long)]
        json: bool,
    },
    /// Compare methods at several budgets on heldout.npz
    ///
    /// A cell of the table is the error (mean squared error / variance of the actions, mean over dimensions) and the true bits
    /// per weight, scales and padding counted; "-" where not even 2 bits fit. Every method uses its default groups; activations
    /// are int8.
    ///
    /// Example: actq sweep policies/ur3 --bpw 2.5,3,4 --svg ur3.svg
    Sweep(SweepArgs),
    /// Run an image as a policy over standard input and output
    ///
    /// Little-endian: "R" resets and has no reply; "S" and the observation as f32 are answered by the action as f32.
    Serve {
        /// The image
        image: PathBuf,
    },
}

#[derive(clap::Args)]
struct QuantizeArgs {
    /// The policy's folder
    policy_dir: PathBuf,
    /// The image to write
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Bits of every weight: 2, 3, 4 or 8 [default: 3]
    #[arg(long, value_name = "N", conflicts_with = "bpw", value_parser = width)]
    bits: Option<Width>,
    /// Bits per weight of the whole, scales and padding counted; each matrix gets a width
    #[arg(long, value_name = "X", value_parser = positive)]
    bpw: Option<f64>,
    /// Bytes of the whole image, as 98304 or 96K
    #[arg(long, value_name = "SIZE", conflicts_with_all = ["bits", "bpw"], value_parser = size)]
    flash: Option<usize>,
    /// Milliseconds that a step may take on a Cortex-M4, predicted; takes the most bits that keep them
    #[arg(long, value_name = "X", conflicts_with_all = ["bits", "bpw", "flash"], value_parser = positive)]
    ms: Option<f64>,
    /// The processor's clock for --ms, in Hz or as 168M
    #[arg(long, value_name = "HZ", requires = "ms", default_value = "168M", value_parser = time::clock)]
    clock: f64,
    /// Force the width of a matrix, by its tensor's name (method best); may be repeated
    #[arg(long, value_name = "NAME=BITS", value_parser = forced)]
    width: Vec<(String, Width)>,
    /// Keep a matrix at 8 bits (method best); may be repeated
    #[arg(long, value_name = "NAME")]
    protect: Vec<String>,
    /// Columns that share a u8 scale: 32, 64 or 128; 0 = one scale a row [default: 32 for rtn and actquant,
    /// 0 for gptq and best]
    #[arg(long, value_name = "N", value_parser = group)]
    group: Option<usize>,
    /// Bits of the activations, whose scale is found at run time [default: for best chosen per matrix, else 8]
    #[arg(long, value_name = "BITS")]
    activations: Option<ActivationArg>,
    /// How codes are chosen [default: best where calib.npz is there (gptq with --group), else rtn]
    #[arg(long)]
    method: Option<MethodArg>,
    /// Steps of distillation for --method best [default: 8000, recurrent policies 1200]
    #[arg(long, value_name = "N")]
    steps: Option<usize>,
    /// Seed of everything that is drawn
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Threads to use; the image does not depend on it [default: all cores]
    #[arg(long, value_name = "N", default_value_t = 0, hide_default_value = true)]
    threads: usize,
}

#[derive(clap::Args)]
struct SweepArgs {
    /// The policy's folder
    policy_dir: PathBuf,
    /// Methods to compare
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "rtn,gptq,actquant,best")]
    methods: Vec<MethodArg>,
    /// Bits per weight of the whole that are allowed
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "2,2.5,3,4", value_parser = positive)]
    bpw: Vec<f64>,
    /// Draw error over bits, and mark the knee of the best method
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// Write errors, bits, bytes and scores
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

#[derive(Clone, Copy, ValueEnum)]
enum ActivationArg {
    /// int8
    #[value(name = "8")]
    Int8,
    /// int16
    #[value(name = "16")]
    Int16,
}

#[derive(Clone, Copy, ValueEnum)]
enum MethodArg {
    /// Round to nearest
    Rtn,
    /// Column-wise error feedback with the inputs' second moment (needs calib.npz)
    Gptq,
    /// Widths by HSIC scores, scales by the Fisher information of the actions (needs calib.npz with actions)
    Actquant,
    /// A width for every row, pruning, and distillation on the recorded observations (needs calib.npz)
    Best,
}

impl From<MethodArg> for Method {
    fn from(arg: MethodArg) -> Self {
        match arg {
            MethodArg::Rtn => Self::Rtn,
            MethodArg::Gptq => Self::Gptq,
            MethodArg::Actquant => Self::ActQuant,
            MethodArg::Best => Self::Best,
        }
    }
}

fn width(text: &str) -> Result<Width, String> {
    let known = text.parse().ok().and_then(Width::from_bits);
    known.ok_or_else(|| "weights have 2, 3, 4 or 8 bits".to_owned())
}

fn forced(text: &str) -> Result<(String, Width), String> {
    let (name, bits) = text.split_once('=').ok_or_else(|| "the form is NAME=BITS".to_owned())?;
    Ok((name.to_owned(), width(bits)?))
}

fn size(text: &str) -> Result<usize, String> {
    let (digits, unit) = match text.strip_suffix(['K', 'k']) {
        Some(digits) => (digits, 1024),
        None => (text, 1),
    };
    let bytes = digits.parse().ok().and_then(|n: usize| n.checked_mul(unit)).filter(|n| *n > 0);
    bytes.ok_or_else(|| "a size is a number of bytes, or of KiB with a K behind it".to_owned())
}

fn group(text: &str) -> Result<usize, String> {
    let known = text.parse().ok().filter(|g| matches!(g, 0 | 32 | 64 | 128));
    known.ok_or_else(|| "groups have 32, 64 or 128 columns, or 0 for none".to_owned())
}

fn positive(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|x: &f64| x.is_finite() && *x > 0.0);
    number.ok_or_else(|| "a number above 0 is needed".to_owned())
}

fn main() -> ExitCode {
    match run(Cli::parse().command) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("actq: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(command: Command) -> Result<()> {
    match command {
        Command::Quantize(args) => run_quantize(&args),
        Command::Inspect { image, clock, json } => {
            let buffer = ImageBuffer::read(&image)?;
            let image = buffer.image(&image)?;
            let step = StepTime::new(&image, clock);
            if json {
                return print(&(serde_json::to_string(&step)? + "\n"));
            }
            print(&format!("{}\n{}", report(&image), step.report()))
        }
        Command::Eval { image, policy, json } => {
            let buffer = ImageBuffer::read(&image)?;
            let image = buffer.image(&image)?;
            let report = eval::evaluate(image, &eval::heldout(&policy, &image)?)?;
            if json {
                return print(&(serde_json::to_string(&report)? + "\n"));
            }
            print(&format!(
                "observations   {}\n\
                 nmse           {:.3e}   (mean squared error / variance, mean over dimensions)\n\
                 worst nmse     {:.3e}   (dimension {})\n\
                 largest error  {:.4}\n\
                 bits/weight    {:.3}\n\
                 image          {} bytes\n",
                report.steps,
                report.nmse,
                report.worst_nmse,
                report.worst_dimension,
                report.max_abs,
                report.bpw,
                report.bytes,
            ))
        }
        Command::Sweep(args) => run_sweep(&args),
        Command::Serve { image } => {
            let buffer = ImageBuffer::read(&image)?;
            serve::serve(buffer.image(&image)?, io::stdin().lock(), io::stdout().lock())
        }
    }
}

fn run_quantize(args: &QuantizeArgs) -> Result<()> {
    let source = Policy::load(&args.policy_dir)?;
    let group = args.group.unwrap_or(0);
    let method = match args.method {
        Some(method) => method.into(),
        None if !args.policy_dir.join("calib.npz").exists() => Method::Rtn,
        None if group > 0 => Method::Gptq,
        None => Method::Best,
    };
    let budget = match (args.bits, args.bpw, args.flash) {
        (_, Some(bpw), _) => Budget::BitsPerWeight(bpw),
        (.., Some(bytes)) => Budget::ImageBytes(bytes),
        (bits, ..) => Budget::Width(bits.unwrap_or(Width::W3)),
    };
    let protected = args.protect.iter().map(|name| (name.clone(), Width::W8));
    let options = Options {
        group: args.group.unwrap_or(method.default_group()),
        activations: match args.activations {
            Some(ActivationArg::Int8) => Activations::Int8,
            Some(ActivationArg::Int16) => Activations::Int16,
            None => Activations::Auto,
        },
        steps: args.steps,
        seed: args.seed,
        forced: args.width.iter().cloned().chain(protected).collect(),
        ..Options::new(method, budget)
    };
    rayon::ThreadPoolBuilder::new().num_threads(args.threads).build_global().context("threads cannot be started")?;
    let bar = progress_bar()?;
    bar.set_message("calibrating");
    let prepared = Prepared::new(&source, method, |share| set_share(&bar, share))?;
    bar.reset();
    bar.set_message("quantizing");
    let limit = args.ms.map(|milliseconds| time::Limit { milliseconds, clock_hz: args.clock });
    let (policy, outcomes) = match limit {
        Some(limit) => limit.quantize(&prepared, &options, |share| set_share(&bar, share))?,
        None => prepared.quantize(&options, |share| set_share(&bar, share))?,
    };
    bar.finish_and_clear();
    let bytes = writer::image(&policy, &outcomes)?;
    writer::write(&args.out, &bytes)?;
    if let Some(statistics) = &prepared.actquant {
        print(&scores(&policy.graph, statistics, budget, &outcomes))?;
    }
    let time = limit.map_or(Ok(String::new()), |limit| limit.predict(&bytes).map(|step| step.sentence()))?;
    let parameters = source.graph.parameters();
    let f32_bytes = 4 * parameters;
    print(&format!(
        "{}\n{}: {} bytes. The policy's {parameters} parameters take {f32_bytes} bytes in f32 ({:.1}x) and {} in bf16 \
         ({:.1}x).\n{time}",
        summary(&policy, &outcomes),
        args.out.display(),
        bytes.len(),
        f32_bytes as f64 / bytes.len() as f64,
        f32_bytes / 2,
        f32_bytes as f64 / 2.0 / bytes.len() as f64,
    ))
}

/// Prints; that a reader has gone away (as `head` does) is no error.
fn print(text: &str) -> Result<()> {
    match io::stdout().write_all(text.as_bytes()) {
        Err(e) if e.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        other => other.context("standard output cannot be written"),
    }
}

/// Steps of the progress bar; the work reports the share done.
const PROGRESS: u64 = 1000;

fn progress_bar() -> Result<ProgressBar> {
    let style = ProgressStyle::with_template("{msg:32} {bar:40} {percent:>3}%, {eta} left").context("progress bar")?;
    Ok(ProgressBar::new(PROGRESS).with_style(style))
}

fn set_share(bar: &ProgressBar, share: f64) {
    bar.set_position((share * PROGRESS as f64) as u64);
}

fn run_sweep(args: &SweepArgs) -> Result<()> {
    let policy = Policy::load(&args.policy_dir)?;
    let methods: Vec<Method> = args.methods.iter().map(|&m| m.into()).collect();
    let bar = progress_bar()?;
    let sweep = sweep::run(&policy, &methods, &args.bpw, |work, share| {
        bar.set_message(work.to_owned());
        set_share(&bar, share);
    })?;
    bar.finish_and_clear();
    let knee = sweep.knee.as_ref().map_or(String::new(), |knee| {
        format!("\nknee: {} at {:.3} bits per weight, NMSE {:.2e}\n", knee.method, knee.bpw, knee.nmse)
    });
    print(&format!("{}\n{knee}", sweep.table()))?;
    let write = |path: &Option<PathBuf>, text: &dyn Fn() -> Result<String>| -> Result<()> {
        let Some(path) = path else { return Ok(()) };
        writer::write(path, text()?.as_bytes())
    };
    write(&args.svg, &|| Ok(sweep.svg()))?;
    write(&args.json, &|| Ok(serde_json::to_string_pretty(&sweep)? + "\n"))
}

fn scores(graph: &Graph, statistics: &Statistics, budget: Budget, outcomes: &[Outcome]) -> String {
    let (_, equal) = statistics.effective_scores();
    let mut rows = table(&["matrix", "HSIC score", "bits"]);
    for ((matrix, score), outcome) in graph.matrices.iter().zip(&statistics.scores).zip(outcomes) {
        let bits = outcome.quantized.width_counts();
        rows.add_row([matrix.name.clone(), format!("{:.4}", score.sens()), bits]);
    }
    let note = match budget {
        Budget::Width(_) => "One width for all: the scores are not used.",
        _ if equal => "No score is above 0: every matrix counts the same.",
        _ => "Scores below 0 count as 0.",
    };
    format!("{rows}\n{note}\n\n")
}

fn summary(policy: &Policy, outcomes: &[Outcome]) -> String {
    let mut rows = table(&["matrix", "shape", "bits", "group", "bytes", "x max", "error"]);
    let mut total = 0;
    for (matrix, outcome) in policy.graph.matrices.iter().zip(outcomes) {
        let quantized = &outcome.quantized;
        let bytes = outcome.bytes();
        total += bytes;
        rows.add_row([
            matrix.name.clone(),
            format!("{}x{}", matrix.rows, matrix.cols),
            quantized.width_counts(),
            group_name(quantized.group),
            bytes.to_string(),
            outcome.x_max.to_string(),
            outcome.error.map_or("-".to_owned(), |e| format!("{e:.2e}")),
        ]);
    }
    let bits = 8.0 * total as f64 / policy.weights.max(1) as f64;
    format!("{rows}\n\n{total} bytes of weights, {bits:.3} bits each, everything counted\n")
}
