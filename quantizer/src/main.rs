//! The command `actq`.
#![forbid(unsafe_code)]

use std::fs;
use std::io;
use std::path::PathBuf;
use std::process::ExitCode;

use actq::graph::Graph;
use actq::inspect::{group_name, report, table};
use actq::policy::Policy;
use actq::quantize::actquant::Statistics;
use actq::quantize::moments::Moments;
use actq::quantize::prepared::Prepared;
use actq::quantize::{Activations, Budget, Method, Outcome};
use actq::runtime::ImageBuffer;
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
    /// POLICY_DIR holds policy.json (the op list), policy.safetensors (the weights) and, for --method gptq and
    /// actquant, calib.npz (recorded observations: array "obs" [episode, step, value], optionally "length" [episode]; for
    /// actquant also "action").
    ///
    /// Example: actq quantize policies/ur3 --bits 3 --out ur3.actq
    Quantize(QuantizeArgs),
    /// Show what is in an image: operations, matrices, bits, memory, the action contract
    Inspect {
        /// The image
        image: PathBuf,
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
    #[arg(long, value_name = "X", value_parser = bits_per_weight)]
    bpw: Option<f64>,
    /// Columns that share a u8 scale: 32, 64 or 128; 0 = one scale a row [default: 32 for rtn and actquant, 0 for gptq]
    #[arg(long, value_name = "N", value_parser = group)]
    group: Option<usize>,
    /// Bits of the activations, whose scale is found at run time
    #[arg(long, value_name = "BITS", default_value = "8")]
    activations: ActivationArg,
    /// How codes are chosen [default: gptq where calib.npz is there, else rtn]
    #[arg(long)]
    method: Option<MethodArg>,
}

#[derive(clap::Args)]
struct SweepArgs {
    /// The policy's folder
    policy_dir: PathBuf,
    /// Methods to compare
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "rtn,gptq,actquant")]
    methods: Vec<MethodArg>,
    /// Bits per weight of the whole that are allowed
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "2,2.5,3,4", value_parser = bits_per_weight)]
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
}

impl From<MethodArg> for Method {
    fn from(arg: MethodArg) -> Self {
        match arg {
            MethodArg::Rtn => Self::Rtn,
            MethodArg::Gptq => Self::Gptq,
            MethodArg::Actquant => Self::ActQuant,
        }
    }
}

fn bits_per_weight(text: &str) -> Result<f64, String> {
    let known = text.parse().ok().filter(|b: &f64| b.is_finite() && *b > 0.0);
    known.ok_or_else(|| "bits per weight are a number above 0".to_owned())
}

fn width(text: &str) -> Result<Width, String> {
    let known = text.parse().ok().and_then(Width::from_bits);
    known.ok_or_else(|| "weights have 2, 3, 4 or 8 bits".to_owned())
}

fn group(text: &str) -> Result<usize, String> {
    let known = text.parse().ok().filter(|g| matches!(g, 0 | 32 | 64 | 128));
    known.ok_or_else(|| "groups have 32, 64 or 128 columns, or 0 for none".to_owned())
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
        Command::Inspect { image } => {
            let buffer = ImageBuffer::read(&image)?;
            print!("{}", report(&buffer.image(&image)?));
            Ok(())
        }
        Command::Eval { image, policy, json } => {
            let buffer = ImageBuffer::read(&image)?;
            let image = buffer.image(&image)?;
            let report = eval::evaluate(image, &eval::heldout(&policy, &image)?)?;
            if json {
                println!("{}", serde_json::to_string(&report)?);
            } else {
                println!("observations   {}", report.steps);
                println!("nmse           {:.3e}   (mean squared error / variance, mean over dimensions)", report.nmse);
                println!("worst nmse     {:.3e}   (dimension {})", report.worst_nmse, report.worst_dimension);
                println!("largest error  {:.4}", report.max_abs);
                println!("bits/weight    {:.3}", report.bpw);
                println!("image          {} bytes", report.bytes);
            }
            Ok(())
        }
        Command::Sweep(args) => run_sweep(&args),
        Command::Serve { image } => {
            let buffer = ImageBuffer::read(&image)?;
            serve::serve(buffer.image(&image)?, io::stdin().lock(), io::stdout().lock())
        }
    }
}

fn run_quantize(args: &QuantizeArgs) -> Result<()> {
    let budget = match (args.bits, args.bpw) {
        (_, Some(bpw)) => Budget::BitsPerWeight(bpw),
        (bits, None) => Budget::Width(bits.unwrap_or(Width::W3)),
    };
    let policy = Policy::load(&args.policy_dir)?;
    let method = match args.method {
        Some(method) => method.into(),
        None if args.policy_dir.join("calib.npz").exists() => Method::Gptq,
        None => Method::Rtn,
    };
    let bar = progress_bar()?;
    bar.set_message("calibrating");
    let prepared = Prepared::new(&policy, method, |share| set_share(&bar, share))?;
    bar.finish_and_clear();
    let activations = match args.activations {
        ActivationArg::Int8 => Activations::Int8,
        ActivationArg::Int16 => Activations::Int16,
    };
    let outcomes = prepared.quantize(&policy.graph, budget, args.group, activations)?;
    let bytes = writer::image(&policy, &outcomes)?;
    writer::write(&args.out, &bytes)?;
    if let Some(statistics) = &prepared.actquant {
        print_scores(&policy.graph, statistics, budget, &outcomes);
    }
    print_summary(&policy.graph, &prepared.moments, &outcomes);
    let f32_bytes = 4 * policy.graph.parameters();
    println!(
        "\n{}: {} bytes. The policy's {} parameters take {f32_bytes} bytes in f32 ({:.1}x) and {} in bf16 ({:.1}x).",
        args.out.display(),
        bytes.len(),
        policy.graph.parameters(),
        f32_bytes as f64 / bytes.len() as f64,
        f32_bytes / 2,
        f32_bytes as f64 / 2.0 / bytes.len() as f64,
    );
    Ok(())
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
    println!("{}", sweep.table());
    if let Some(knee) = &sweep.knee {
        println!("\nknee: {} at {:.3} bits per weight, NMSE {:.2e}", knee.method, knee.bpw, knee.nmse);
    }
    let write = |path: &Option<PathBuf>, text: &dyn Fn() -> Result<String>| -> Result<()> {
        let Some(path) = path else { return Ok(()) };
        fs::write(path, text()?).with_context(|| format!("{}: cannot be written", path.display()))
    };
    write(&args.svg, &|| Ok(sweep.svg()))?;
    write(&args.json, &|| Ok(serde_json::to_string_pretty(&sweep)? + "\n"))
}

fn print_scores(graph: &Graph, statistics: &Statistics, budget: Budget, outcomes: &[Outcome]) {
    let (_, equal) = statistics.effective_scores();
    let mut rows = table(&["matrix", "HSIC score", "bits"]);
    for ((matrix, score), outcome) in graph.matrices.iter().zip(&statistics.scores).zip(outcomes) {
        let bits = outcome.quantized.widths.first().map_or(0, |w| w.bits());
        rows.add_row([matrix.name.clone(), format!("{:.4}", score.sens()), bits.to_string()]);
    }
    println!("{rows}");
    match budget {
        Budget::Width(_) => println!("One width for all: the scores are not used.\n"),
        Budget::BitsPerWeight(_) if equal => println!("No score is above 0: every matrix counts the same.\n"),
        Budget::BitsPerWeight(_) => println!("Scores below 0 count as 0.\n"),
    }
}

fn print_summary(graph: &Graph, moments: &[Moments], outcomes: &[Outcome]) {
    let error = if moments.is_empty() { "error (weights)" } else { "error (outputs)" };
    let mut rows = table(&["matrix", "shape", "bits", "group", "bits/weight", "bytes", "x max", error]);
    let mut total = 0;
    for (matrix, outcome) in graph.matrices.iter().zip(outcomes) {
        let quantized = &outcome.quantized;
        let bytes = quantized.bytes();
        total += bytes;
        rows.add_row([
            matrix.name.clone(),
            format!("{}x{}", matrix.rows, matrix.cols),
            quantized.blocks().iter().map(|(s, _)| s.width.bits().to_string()).collect::<Vec<_>>().join(","),
            group_name(quantized.group),
            format!("{:.3}", 8.0 * bytes as f64 / matrix.data.len() as f64),
            bytes.to_string(),
            outcome.x_max.to_string(),
            format!("{:.2e}", outcome.error),
        ]);
    }
    rows.add_row([
        "all".to_owned(),
        String::new(),
        String::new(),
        String::new(),
        format!("{:.3}", 8.0 * total as f64 / graph.weights() as f64),
        total.to_string(),
    ]);
    println!("{rows}");
}
