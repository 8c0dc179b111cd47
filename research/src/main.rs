//! The research command: `quantize` and `sweep` with method actquant, and `cargo xtask compare`, for which xtask builds
//! this binary and runs it.
#![forbid(unsafe_code)]

use std::process::ExitCode;

use actq_research::commands::{Job, Quantize, Sweep};
use actq_research::compare::{self, Plan};
use clap::Parser;

/// Measure the quantizer's methods and their rivals
#[derive(Parser)]
#[command(name = "actq-research", bin_name = "cargo run --release -p actq-research --", max_term_width = 100)]
enum Command {
    /// Quantize a policy into an image, as `actq quantize` does, with actquant among the methods
    Quantize(Quantize),
    /// Compare methods at several budgets, as `actq sweep` does, with actquant among the methods
    Sweep(Sweep),
    /// Run one job of a sweep, as `actq job` does; `sweep` starts it
    Job(Job),
    /// Compare the methods at equal budgets: held-out error, true bits, closed-loop success
    ///
    /// The policies are the UR3 policy and, if ACTQ_SHARED names their folder, the shared ones. Their tasks run in
    /// MuJoCo with the Python of ACTQ_MUJOCO_PYTHON (go1_*, g1_*) and ACTQ_GYMNASIUM_PYTHON (fetch_*). Each result is
    /// appended to DIR/compare.jsonl as soon as it is known: the same command resumes an interrupted run. The report is
    /// DIR/compare.md.
    #[command(override_usage = "cargo xtask compare [OPTIONS] --out <DIR>")]
    Compare(Plan),
}

fn main() -> ExitCode {
    let plan = match Command::parse() {
        Command::Quantize(command) => return actq_cli::run_work(|| command.run()),
        Command::Sweep(command) => return actq_cli::run_work(|| command.run()),
        Command::Job(command) => return actq_cli::run_work(|| command.run()),
        Command::Compare(plan) => plan,
    };
    match compare::run(&plan) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("\nerror: {error:#}");
            ExitCode::FAILURE
        }
    }
}
