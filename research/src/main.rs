//! The command `cargo xtask compare`: xtask builds this binary and runs it.
#![forbid(unsafe_code)]

use std::process::ExitCode;

use actq_research::compare::{self, Plan};
use clap::Parser;

/// Measure the quantizer's methods and their rivals
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask", max_term_width = 100)]
enum Command {
    /// Compare the methods at equal budgets: held-out error, true bits, closed-loop success
    ///
    /// The policies are the UR3 policy and, if ACTQ_SHARED names their folder, the shared ones. Their tasks run in
    /// MuJoCo with the Python of ACTQ_MUJOCO_PYTHON (go1_*, g1_*) and ACTQ_GYMNASIUM_PYTHON (fetch_*). Each result is
    /// appended to DIR/compare.jsonl as soon as it is known: the same command resumes an interrupted run. The report is
    /// DIR/compare.md.
    Compare(Plan),
}

fn main() -> ExitCode {
    let Command::Compare(plan) = Command::parse();
    match compare::run(&plan) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("\nerror: {error:#}");
            ExitCode::FAILURE
        }
    }
}
