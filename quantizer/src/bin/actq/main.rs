//! The command `actq`.
#![forbid(unsafe_code)]

mod args;
mod check;
mod drive;
mod eval;
mod group;
mod import;
mod inputs;
#[cfg(unix)]
mod interrupts;
mod link;
mod quantize;
mod serve;
mod sign;
mod suggestions;
mod terminal;
mod threads;
mod tune;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use actq::data::{Learned, Recording, Recordings, Sizes, files_of};
use actq::emit::unfinished;
use actq::measure::time::StepTime;
use actq::methods::Method;
use actq::pipeline::stats::Stats;
use actq::pipeline::sweep::{self, SweepPlan};
use actq::policy::Policy;
use actq::report::widths::Widths;
use actq::report::{self, inspect, notes, time};
use actq::runtime::ImageBuffer;
use actq::text::printable;
use anyhow::{Result, ensure};

use args::{Command, InspectArgs, SweepArgs};
use inputs::policy_files;
use terminal::{Progress, note, print, reserve};
use threads::start_threads;

fn main() -> ExitCode {
    let outcome = run(suggestions::parse().command);
    // Where a signal ends the process, it decides the exit status.
    let _held = unfinished::hold();
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("actq: {}", printable(&format!("{error:#}")));
            ExitCode::FAILURE
        }
    }
}

fn run(command: Command) -> Result<()> {
    #[cfg(unix)]
    interrupts::watch()?;
    match command {
        Command::Import(args) => import::run(&args),
        Command::Quantize(args) => quantize::run(&args),
        Command::Inspect(args) => run_inspect(&args),
        Command::Eval(args) => eval::run(&args),
        Command::Tune(args) => tune::run(&args),
        Command::Sweep(args) => run_sweep(&args),
        Command::Serve(args) => serve::run(&args),
        Command::Link(args) => link::run(&args),
        Command::Keygen(args) => sign::keygen(&args),
        Command::Sign(args) => sign::sign(&args),
    }
}

fn run_inspect(args: &InspectArgs) -> Result<()> {
    let inputs = [Some(&args.image), args.stats.as_ref()].into_iter().flatten().cloned().collect::<Vec<_>>();
    let outputs = reserve(args.svg.as_deref().as_slice(), &inputs)?;
    let buffer = ImageBuffer::read(&args.image)?;
    let image = buffer.image(&args.image)?;
    if !args.widths {
        let step = StepTime::new(&image, args.clock);
        return print(&match args.json {
            true => serde_json::to_string(&step)? + "\n",
            false => format!("{}\n{}", inspect::report(&image), time::report(&step)),
        });
    }
    let stats = args.stats.as_deref().map(|path| Stats::read(path, &image)).transpose()?;
    let widths = Widths::new(&image, stats.as_ref())?;
    if args.svg.is_some() {
        outputs.write(&[widths.svg()])?;
    }
    print(&widths.report())
}

fn run_sweep(args: &SweepArgs) -> Result<()> {
    let folders = args.policy_dirs.iter().flat_map(|dir| policy_files(dir));
    let calib = files_of(&args.calib)?;
    let inputs: Vec<PathBuf> = folders.chain(calib.iter().chain(&args.heldout).cloned()).collect();
    let outputs: Vec<&Path> = [&args.svg, &args.json].into_iter().filter_map(|path| path.as_deref()).collect();
    let outputs = reserve(&outputs, &inputs)?;
    let progress = Progress::new(args.run.quiet, "reading")?;
    start_threads(args.run.threads)?;
    let methods: Vec<Method> = args.methods.iter().map(|&method| method.into()).collect();
    let methods = args.actquant.of(&methods)?;
    let policies = args.policy_dirs.iter().map(|dir| Policy::load(dir)).collect::<Result<Vec<_>>>()?;
    let named = !calib.is_empty() || args.heldout.is_some();
    ensure!(policies.len() == 1 || !named, "--calib and --heldout go with one policy");
    let mut sweeps = Vec::new();
    for (p, policy) in policies.iter().enumerate() {
        let (dir, sizes) = (Some(policy.dir.as_path()), Sizes::of(policy));
        let calib = Learned::load(policy, &calib)?.map(|learned| learned.dataset);
        let heldout = Recording::Heldout.require(dir, args.heldout.as_deref(), sizes, "actq sweep")?;
        let recordings = Recordings { calib, heldout: Some(heldout) };
        note(notes::of_recordings(&recordings));
        let plan = SweepPlan {
            policy,
            recordings,
            methods: &methods,
            budgets: &args.bpw,
            steps: args.learn.steps,
            minutes: args.learn.minutes,
            relative: args.learn.relative,
            seed: args.run.seed,
        };
        sweeps.push(sweep::run(plan, |work, share| {
            progress.set(&format!("{}: {work}", policy.name), (p as f64 + share) / policies.len() as f64);
        })?);
    }
    drop(progress);
    let mut knees = String::new();
    for sweep in &sweeps {
        if let Some(knee) = &sweep.knee {
            knees += &format!(
                "\n* knee of {}: {} at {:.3} bits per weight, NMSE {:.2e}",
                sweep.policy, knee.method, knee.bpw, knee.nmse
            );
        }
    }
    print(&format!("{}\n{knees}\n", report::sweep::table(&sweeps)))?;
    let (svg, json) = (report::sweep::svg(&sweeps), serde_json::to_string_pretty(&sweeps)? + "\n");
    let contents = [args.svg.is_some().then_some(svg), args.json.is_some().then_some(json)];
    outputs.write(&contents.into_iter().flatten().collect::<Vec<_>>())
}
