//! The command `actq`.
#![forbid(unsafe_code)]

use std::io;
use std::path::PathBuf;
use std::process::ExitCode;

use actq::dataset::Dataset;
use actq::graph::Graph;
use actq::inspect::{group_name, report, table};
use actq::policy::Policy;
use actq::quantize::moments::{Moments, collect};
use actq::quantize::{Activations, Budget, Method, Options, Outcome, quantize};
use actq::runtime::ImageBuffer;
use actq::{eval, serve, writer};
use actq_kernels::Width;
use anyhow::{Context, Result, ensure};
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
    /// POLICY_DIR holds policy.json (the op list), policy.safetensors (the weights) and, for --method gptq, calib.npz
    /// (recorded observations: array "obs" [episode, step, value], optionally "length" [episode]).
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
    #[arg(long, value_name = "X")]
    bpw: Option<f64>,
    /// Columns that share a u8 scale: 32, 64 or 128; 0 = one scale a row [default: 32 for rtn, 0 for gptq]
    #[arg(long, value_name = "N", value_parser = group)]
    group: Option<usize>,
    /// Bits of the activations, whose scale is found at run time
    #[arg(long, value_name = "BITS", default_value = "8")]
    activations: ActivationArg,
    /// How codes are chosen [default: gptq where calib.npz is there, else rtn]
    #[arg(long)]
    method: Option<MethodArg>,
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
        Command::Serve { image } => {
            let buffer = ImageBuffer::read(&image)?;
            serve::serve(buffer.image(&image)?, io::stdin().lock(), io::stdout().lock())
        }
    }
}

fn run_quantize(args: &QuantizeArgs) -> Result<()> {
    let budget = match (args.bits, args.bpw) {
        (_, Some(bpw)) => {
            ensure!(bpw.is_finite() && bpw > 0.0, "--bpw is {bpw}, it must be above 0");
            Budget::BitsPerWeight(bpw)
        }
        (bits, None) => Budget::Width(bits.unwrap_or(Width::W3)),
    };
    let policy = Policy::load(&args.policy_dir)?;
    let calib = args.policy_dir.join("calib.npz");
    let method = match args.method {
        Some(MethodArg::Rtn) => Method::Rtn,
        Some(MethodArg::Gptq) => Method::Gptq,
        None if calib.exists() => Method::Gptq,
        None => Method::Rtn,
    };
    let moments = match method {
        Method::Rtn => Vec::new(),
        Method::Gptq => {
            let dataset = Dataset::load(&calib, policy.graph.obs_len, policy.chunk * policy.act_len)?;
            let bar = ProgressBar::new(dataset.frames() as u64).with_style(
                ProgressStyle::with_template("calibrating {bar:40} {pos}/{len} frames, {eta} left")
                    .context("progress bar")?,
            );
            let moments = collect(&policy.graph, &dataset, |frames| bar.set_position(frames as u64));
            bar.finish_and_clear();
            moments
        }
    };
    let activations = match args.activations {
        ActivationArg::Int8 => Activations::Int8,
        ActivationArg::Int16 => Activations::Int16,
    };
    // Error feedback makes good what one scale a row loses; plain rounding has only its scales.
    let default_group = if method == Method::Rtn { 32 } else { 0 };
    let options = Options { method, budget, group: args.group.unwrap_or(default_group), activations };
    let outcomes = quantize(&policy.graph, &moments, &options)?;
    let bytes = writer::image(&policy, &outcomes)?;
    writer::write(&args.out, &bytes)?;
    print_summary(&policy.graph, &moments, &outcomes);
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

fn print_summary(graph: &Graph, moments: &[Moments], outcomes: &[Outcome]) {
    let error = if moments.is_empty() { "error (weights)" } else { "error (outputs)" };
    let mut rows = table(&["matrix", "shape", "bits", "group", "bits/weight", "bytes", "x max", error]);
    let mut total = 0;
    for (matrix, outcome) in graph.matrices.iter().zip(outcomes) {
        let quantized = &outcome.quantized;
        let bytes = outcome.bytes();
        total += bytes;
        rows.add_row([
            matrix.name.clone(),
            format!("{}x{}", matrix.rows, matrix.cols),
            outcome.blocks().iter().map(|(s, _)| s.width.bits().to_string()).collect::<Vec<_>>().join(","),
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
