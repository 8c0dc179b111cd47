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
    /// Run one job of a sweep or a comparison, as `actq job` does; the other commands start it
    Job(Job),
    /// Compare the methods at equal budgets: held-out error, true bits, closed-loop success
    ///
    /// The policies are the UR3 policy and, if ACTQ_SHARED names their folder, the shared ones. Their tasks run in
    /// MuJoCo with the Python of ACTQ_MUJOCO_PYTHON (go1_*, g1_*) and ACTQ_GYMNASIUM_PYTHON (fetch_*). Each image and
    /// each closed loop is a job, whose result is kept in DIR/store. The same command resumes an interrupted run, also
    /// at a later commit that makes the same images. The report is DIR/compare.md.
    #[command(override_usage = "cargo xtask compare [OPTIONS] --out <DIR>")]
    Compare(Plan),
}

fn main() -> ExitCode {
    let command = Command::parse();
    actq_cli::run_work(|| match &command {
        Command::Quantize(command) => command.run(),
        Command::Sweep(command) => command.run(),
        Command::Job(command) => command.run(),
        Command::Compare(plan) => compare::run(plan),
    })
}
