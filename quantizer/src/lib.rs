//! The command `actq`: command line, tables, plots, progress, and the host's end of the link. The library `actq` does
//! the work on policies and images.
#![forbid(unsafe_code)]

mod agreement;
mod args;
mod check;
mod commands;
mod group;
mod importers;
#[cfg(unix)]
mod interrupts;
pub mod outputs;
pub mod report;
mod serve;
mod suggestions;
mod terminal;
mod threads;

use std::process::ExitCode;

use actq::text::printable;
use anyhow::Result;

use args::Command;
use commands::{eval, import, inspect, link, quantize, sign, sweep, tune};
use outputs::unfinished;

/// Runs the command line of this process.
pub fn run() -> ExitCode {
    let outcome = run_command(&suggestions::parse().command);
    // If a signal ends the process, the signal decides the exit status.
    let _held = unfinished::hold();
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("actq: {}", printable(&format!("{error:#}")));
            ExitCode::FAILURE
        }
    }
}

fn run_command(command: &Command) -> Result<()> {
    #[cfg(unix)]
    interrupts::watch()?;
    match command {
        Command::Import(args) => import::run(args),
        Command::Quantize(args) => quantize::run(args),
        Command::Inspect(args) => inspect::run(args),
        Command::Eval(args) => eval::run(args),
        Command::Tune(args) => tune::run(args),
        Command::Sweep(args) => sweep::run(args),
        Command::Serve(args) => commands::serve::run(args),
        Command::Link(args) => link::run(args),
        Command::Keygen(args) => sign::keygen(args),
        Command::Sign(args) => sign::sign(args),
    }
}
