//! The command `actq`.
#![forbid(unsafe_code)]

use std::io::{self, Write as _};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use actq::dataset::Sizes;
use actq::dataset::range::Range;
use actq::dataset::recording::Recording;
use actq::graph::Graph;
use actq::inspect::{group_name, report, table};
use actq::policy::Policy;
use actq::quantize::actquant::Statistics;
use actq::quantize::prepared::Prepared;
use actq::quantize::{Activations, Budget, Method, Options, Outcome};
use actq::runtime::ImageBuffer;
use actq::search::{self, Measure};
use actq::stats::{Asked, Stats};
use actq::time::{self, StepTime};
use actq::widths::{self, Widths};
use actq::{check, eval, serve, sweep, writer};
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
    /// POLICY_DIR holds policy.json (the op list), policy.safetensors (the weights) and, for every method but rtn, a recording
    /// to learn from: calib.npz or calib.safetensors with the arrays "obs" [episode, step, value] and optionally "action" (the
    /// network's raw output at each observation), "length" [episode] (valid steps) and "state" [episode, value] (recurrent
    /// state before the first step), or calib.npy with the observations alone. Two axes [frame, value] are one episode. Where
    /// heldout.npz, .npy or .safetensors is there too, the image is run on both, and errors and warnings are printed.
    ///
    /// Example: actq quantize policies/ur3 --bits 3 --out ur3.actq
    Quantize(QuantizeArgs),
    /// Show what is in an image: operations, matrices, bits, memory, time on a Cortex-M4, the action contract
    ///
    /// Example: actq inspect ur3.actq --widths --stats ur3.json --svg ur3.svg
    Inspect(InspectArgs),
    /// Compare an image's actions with the f32 policy's on held-out observations
    ///
    /// The recording is heldout.npz, .npy or .safetensors in POLICY_DIR, or the file named. It holds "obs" and "action"; without
    /// "action", the policy in POLICY_DIR gives the actions. Also printed: how much of the error comes from rounding the
    /// activations, and, where calib.npz, .npy or .safetensors is there, a warning if the observations leave its range.
    ///
    /// Example: actq eval ur3.actq --policy policies/ur3
    Eval {
        /// The image
        image: PathBuf,
        /// The policy's folder, with the recordings
        #[arg(long, value_name = "POLICY_DIR", required_unless_present = "heldout")]
        policy: Option<PathBuf>,
        /// The held-out recording: .npz, .npy or .safetensors [default: the one in POLICY_DIR]
        #[arg(long, value_name = "FILE")]
        heldout: Option<PathBuf>,
        /// Print one JSON object: nmse, worst_nmse, max_abs, steps, bpw, bytes
        #[arg(long)]
        json: bool,
    },
    /// Compare methods at several budgets on held-out observations
    ///
    /// A cell of the table is the error (mean squared error / variance of the actions, mean over dimensions) and the true bits
    /// per weight, scales and padding counted; "-" where not even 2 bits fit. Every method uses its default groups; activations
    /// are int8, for best int16 where it pays. A star marks the knee of a policy's best method.
    ///
    /// Example: actq sweep policies/ur3 policies/go1 --bpw 2.5,3,4 --svg errors.svg
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
    /// The recording to learn from: .npz, .npy or .safetensors [default: calib.* in POLICY_DIR]
    #[arg(long, value_name = "FILE")]
    calib: Option<PathBuf>,
    /// Bits of every weight: 2, 3, 4 or 8 [default: 3]
    #[arg(long, value_name = "N", conflicts_with = "bpw", value_parser = width)]
    bits: Option<Width>,
    /// Bits per weight of the whole, scales and padding counted; each matrix gets a width
    #[arg(long, value_name = "X", value_parser = positive)]
    bpw: Option<f64>,
    /// Bytes of the whole image, as 98304 or 96K
    #[arg(long, value_name = "SIZE", conflicts_with_all = ["bits", "bpw"], value_parser = size)]
    flash: Option<usize>,
    /// The fewest bits whose error (NMSE, as eval measures it) is at most X, to a tenth of a bit per weight; measured on
    /// the held-out recording, else on that of calibration
    #[arg(long, value_name = "X", conflicts_with_all = ["bits", "bpw", "flash"], value_parser = positive)]
    max_nmse: Option<f64>,
    /// Milliseconds that a step may take on a Cortex-M4, predicted; takes the most bits that keep them
    #[arg(long, value_name = "X", conflicts_with_all = ["bits", "bpw", "flash", "max_nmse"], value_parser = positive)]
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
    /// Columns that share a u8 scale: 32, 64 or 128; 0 = one scale a row, which the kernels like best [default: 32 for
    /// rtn and actquant, 0 for gptq and best]
    #[arg(long, value_name = "N", value_parser = group)]
    group: Option<usize>,
    /// Bits of the activations, whose scale is found at run time [default: for best chosen per matrix, else 8]
    #[arg(long, value_name = "BITS")]
    activations: Option<ActivationArg>,
    /// How codes are chosen [default: best where there is a recording to learn from, else rtn]
    #[arg(long)]
    method: Option<MethodArg>,
    /// Steps of distillation for --method best; 0 = none, but two-sided error feedback: seconds, and a larger error at few
    /// bits [default: 8000, recurrent policies 1200]
    #[arg(long, value_name = "N")]
    steps: Option<usize>,
    /// Seed of everything that is drawn
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Threads to use; the image does not depend on it [default: all cores]
    #[arg(long, value_name = "N", default_value_t = 0, hide_default_value = true)]
    threads: usize,
    /// Write the statistics and the allocation as JSON, for `actq inspect --stats`
    #[arg(long, value_name = "FILE")]
    save_stats: Option<PathBuf>,
}

#[derive(clap::Args)]
struct InspectArgs {
    /// The image
    image: PathBuf,
    /// The processor's clock, in Hz or as 168M
    #[arg(long, value_name = "HZ", default_value = "168M", value_parser = time::clock)]
    clock: f64,
    /// Print the predicted time of every operation and of the step as one JSON object
    #[arg(long, conflicts_with = "widths")]
    json: bool,
    /// Show instead which rows have which width
    #[arg(long)]
    widths: bool,
    /// What --save-stats wrote with this image: adds why rows have their widths, and the rows that were removed
    #[arg(long, value_name = "FILE", requires = "widths")]
    stats: Option<PathBuf>,
    /// Draw the widths
    #[arg(long, value_name = "FILE", requires = "widths")]
    svg: Option<PathBuf>,
}

#[derive(clap::Args)]
struct SweepArgs {
    /// The policies' folders
    #[arg(required = true)]
    policy_dirs: Vec<PathBuf>,
    /// Methods to compare
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "rtn,gptq,actquant,best")]
    methods: Vec<MethodArg>,
    /// Bits per weight of the whole that are allowed
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "2,2.5,3,4", value_parser = positive)]
    bpw: Vec<f64>,
    /// The recording to learn from: .npz, .npy or .safetensors [default: calib.* in POLICY_DIR]
    #[arg(long, value_name = "FILE")]
    calib: Option<PathBuf>,
    /// The held-out recording to measure on [default: heldout.* in POLICY_DIR]
    #[arg(long, value_name = "FILE")]
    heldout: Option<PathBuf>,
    /// Draw error over bits, and mark the knee of the best method
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// Write errors, bits, bytes, allocations and scores: an array with one object per policy
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Steps of distillation for method best [default: 8000, recurrent policies 1200]
    #[arg(long, value_name = "N")]
    steps: Option<usize>,
    /// Seed of everything that is drawn
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Threads to use; no figure depends on it [default: all cores]
    #[arg(long, value_name = "N", default_value_t = 0, hide_default_value = true)]
    threads: usize,
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
    /// Column-wise error feedback with the inputs' second moment (needs a recording)
    Gptq,
    /// Widths by HSIC scores, scales by the Fisher information of the actions (needs a recording with actions)
    Actquant,
    /// A width for every row, pruning, and distillation on the recorded observations (needs a recording)
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
        Command::Inspect(args) => run_inspect(&args),
        Command::Eval { image, policy, heldout, json } => {
            let buffer = ImageBuffer::read(&image)?;
            let image = buffer.image(&image)?;
            let dataset = eval::heldout_from(policy.as_deref(), heldout.as_deref(), &image)?;
            let report = eval::evaluate(image, &dataset)?;
            match Recording::Calib.load(policy.as_deref(), None, Sizes::of_image(&image)) {
                Ok(calib) => note(calib.and_then(|calib| Range::of(&calib).warning(&dataset))),
                Err(error) => note([format!("the calibrated range is not known: {error:#}")]),
            }
            if json {
                return print(&(serde_json::to_string(&report)? + "\n"));
            }
            print(&format!(
                "observations   {}\n\
                 nmse           {:.3e}   (mean squared error / variance, mean over dimensions)\n\
                 worst nmse     {:.3e}   (dimension {})\n\
                 largest error  {:.4}\n\
                 activations    {}\n\
                 bits/weight    {:.3}\n\
                 image          {} bytes\n",
                report.steps,
                report.nmse,
                report.worst_nmse,
                report.worst_dimension,
                report.max_abs,
                eval::activation_share(image, &dataset, report.nmse)?,
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
    let one_file = args.save_stats.as_ref() == Some(&args.out);
    ensure!(!one_file, "{}: image and statistics need two files", args.out.display());
    let (dir, sizes) = (Some(args.policy_dir.as_path()), Sizes::of(&source));
    let calib = Recording::Calib.load(dir, args.calib.as_deref(), sizes)?;
    let heldout = Recording::Heldout.load(dir, None, sizes)?;
    note(check::recording_notes(calib.as_ref(), heldout.as_ref()));
    let method = match args.method {
        Some(method) => method.into(),
        None if calib.is_none() => Method::Rtn,
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
    let started = Instant::now();
    start_threads(args.threads)?;
    let measure = args.max_nmse.map(|_| Measure::new(&source, calib.as_ref(), heldout.as_ref())).transpose()?;
    let bar = progress_bar()?;
    bar.set_message("calibrating");
    let prepared = Prepared::with_recording(&source, method, calib.as_ref(), |share| set_share(&bar, share))?;
    bar.reset();
    bar.set_message("quantizing");
    let limit = args.ms.map(|milliseconds| time::Limit { milliseconds, clock_hz: args.clock });
    let (policy, outcomes, options, search) = match (args.max_nmse.zip(measure.as_ref()), limit) {
        (None, None) => {
            let (policy, outcomes) = prepared.quantize(&options, |share| set_share(&bar, share))?;
            (policy, outcomes, options, String::new())
        }
        (None, Some(limit)) => {
            let (policy, outcomes, options) = limit.quantize(&prepared, &options, |share| set_share(&bar, share))?;
            (policy, outcomes, options, String::new())
        }
        (Some((limit, measure)), _) => {
            let found = search::smallest(&source, &prepared, &options, limit, measure, |work, share| {
                bar.set_message(work.to_owned());
                set_share(&bar, share);
            })?;
            let note = format!("{}\n", found.report(limit, measure));
            (found.policy, found.outcomes, found.options, note)
        }
    };
    bar.finish_and_clear();
    let bytes = writer::image(&policy, &outcomes)?;
    let mut files = vec![(args.out.as_path(), bytes.clone())];
    if let Some(path) = &args.save_stats {
        let asked = match (args.max_nmse, limit) {
            (Some(nmse), _) => Asked::MaxNmse(nmse),
            (_, Some(time::Limit { milliseconds, clock_hz })) => Asked::Time { milliseconds, clock_hz },
            _ => budget.into(),
        };
        let buffer = ImageBuffer::new(&bytes);
        let (scores, steps) = (prepared.actquant.as_ref().map_or(&[][..], |s| &s.scores), prepared.steps(&options));
        let stats = Stats::new(&source, asked, &options, &outcomes, scores, steps, &buffer.image(&args.out)?);
        files.push((path, stats.json()?.into_bytes()));
    }
    writer::write_all(&files)?;
    if let Some(statistics) = &prepared.actquant {
        print(&scores(&policy.graph, statistics, options.budget, &outcomes))?;
    }
    let time = limit.map_or(Ok(String::new()), |limit| limit.predict(&bytes).map(|step| step.sentence()))?;
    let parameters = source.graph.parameters();
    let f32_bytes = 4 * parameters;
    print(&format!(
        "{search}{}\n{}: {} bytes. The policy's {parameters} parameters take {f32_bytes} bytes in f32 ({:.1}x) and {} in bf16 \
         ({:.1}x).\n{time}Took {:.1} s.\n",
        summary(&policy, &outcomes),
        args.out.display(),
        bytes.len(),
        f32_bytes as f64 / bytes.len() as f64,
        f32_bytes / 2,
        f32_bytes as f64 / 2.0 / bytes.len() as f64,
        started.elapsed().as_secs_f64(),
    ))?;
    let Some(heldout) = heldout else { return Ok(()) };
    let buffer = ImageBuffer::new(&bytes);
    match check::check(&source, buffer.image(&args.out)?, calib.as_ref(), &heldout) {
        Ok(check) => {
            print(&format!("\n{}", check.summary()))?;
            note(check.overfit_warning());
        }
        // The image is written, and nothing is wrong with it.
        Err(error) => note([format!("the held-out error is not known: {error:#}")]),
    }
    Ok(())
}

/// Notes go to standard error, so that the report stays as it is.
fn note(notes: impl IntoIterator<Item = String>) {
    // That nobody reads them is no error.
    notes.into_iter().for_each(|note| drop(writeln!(io::stderr(), "note: {note}")));
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
    // Within 80 columns: a bar that wraps flickers.
    let style = ProgressStyle::with_template("{msg:30} {bar:30} {percent:>3}%, {eta} left").context("progress bar")?;
    Ok(ProgressBar::new(PROGRESS).with_style(style))
}

fn set_share(bar: &ProgressBar, share: f64) {
    bar.set_position((share * PROGRESS as f64) as u64);
}

fn start_threads(threads: usize) -> Result<()> {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build_global().context("threads cannot be started")
}

fn run_inspect(args: &InspectArgs) -> Result<()> {
    let buffer = ImageBuffer::read(&args.image)?;
    let image = buffer.image(&args.image)?;
    if !args.widths {
        let step = StepTime::new(&image, args.clock);
        return print(&match args.json {
            true => serde_json::to_string(&step)? + "\n",
            false => format!("{}\n{}", report(&image), step.report()),
        });
    }
    let stats = args.stats.as_deref().map(|path| Stats::read(path, &image)).transpose()?;
    let widths = Widths::new(&image, stats.as_ref())?;
    if let Some(path) = &args.svg {
        writer::write(path, widths.svg().as_bytes())?;
    }
    print(&widths.report())
}

fn run_sweep(args: &SweepArgs) -> Result<()> {
    start_threads(args.threads)?;
    let methods: Vec<Method> = args.methods.iter().map(|&m| m.into()).collect();
    let policies = args.policy_dirs.iter().map(|dir| Policy::load(dir)).collect::<Result<Vec<_>>>()?;
    let named = args.calib.is_some() || args.heldout.is_some();
    ensure!(policies.len() == 1 || !named, "--calib and --heldout go with one policy");
    let bar = progress_bar()?;
    let mut sweeps = Vec::new();
    for (p, policy) in policies.iter().enumerate() {
        let (dir, sizes) = (Some(policy.dir.as_path()), Sizes::of(policy));
        let calib = Recording::Calib.load(dir, args.calib.as_deref(), sizes)?;
        let mut heldout = Recording::Heldout.require(dir, args.heldout.as_deref(), sizes, "actq sweep")?;
        heldout.fill_actions(&policy.graph);
        bar.suspend(|| note(check::recording_notes(calib.as_ref(), Some(&heldout))));
        let plan = sweep::Plan {
            policy,
            calib: calib.as_ref(),
            heldout: &heldout,
            methods: &methods,
            budgets: &args.bpw,
            steps: args.steps,
            seed: args.seed,
        };
        sweeps.push(sweep::run(&plan, |work, share| {
            bar.set_message(format!("{}: {work}", policy.name));
            set_share(&bar, (p as f64 + share) / policies.len() as f64);
        })?);
    }
    bar.finish_and_clear();
    let mut knees = String::new();
    for sweep in &sweeps {
        if let Some(knee) = &sweep.knee {
            knees += &format!(
                "\n* knee of {}: {} at {:.3} bits per weight, NMSE {:.2e}",
                sweep.policy, knee.method, knee.bpw, knee.nmse
            );
        }
    }
    print(&format!("{}\n{knees}\n", sweep::table(&sweeps)))?;
    let (svg, json) = (sweep::svg(&sweeps), serde_json::to_string_pretty(&sweeps)? + "\n");
    let files = [(&args.svg, svg), (&args.json, json)];
    let files: Vec<_> = files.iter().filter_map(|(path, text)| Some((path.as_deref()?, text))).collect();
    writer::write_all(&files)
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
    let by_row = outcomes.iter().any(|outcome| outcome.allocation.is_some());
    let widths = if by_row { widths::line(policy, outcomes) + "\n" } else { String::new() };
    format!("{rows}\n\n{total} bytes of weights, {bits:.3} bits each, everything counted\n{widths}")
}
