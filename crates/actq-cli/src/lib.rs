//! The command `actq`: command line, tables, reports, progress, and the host's end of the link. The library `actq` does
//! the work on policies and images.
#![forbid(unsafe_code)]

mod agreement;
pub mod args;
mod check;
pub mod commands;
mod ending;
mod group;
pub mod importers;
#[cfg(unix)]
mod interrupts;
pub mod outputs;
pub mod probes;
mod questions;
pub mod report;
mod serve;
mod suggestions;
mod terminal;
mod threads;

use std::process::ExitCode;

use actq::text::printable_lines;
use actq_jobs::error::{AGAIN, JobError};
use anyhow::Result;

use args::{Cli, Command, MethodArg};
use commands::jobs::host::Command as Host;
use commands::{bundle, eval, import, inspect, jobs, link, quantize, sign, sweep, tune};
use outputs::unfinished;

/// Runs the command line of this process.
pub fn run() -> ExitCode {
    match suggestions::parse() {
        Ok(Cli { command }) => run_work(|| run_command(&command)),
        Err(status) => status,
    }
}

/// Runs the work of a command and prints its error. A signal ends the process without partial outputs.
pub fn run_work(work: impl FnOnce() -> Result<()>) -> ExitCode {
    #[cfg(unix)]
    let outcome = interrupts::watch().and_then(|()| work());
    #[cfg(not(unix))]
    let outcome = work();
    // If a signal ends the process, the signal decides the exit status.
    let _held = unfinished::hold();
    if let (Ok(()), Some(signal)) = (&outcome, ending::stop_signal()) {
        eprintln!("actq: interrupted");
        return ExitCode::from(128 + signal as u8);
    }
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("actq: {}", printable_lines(format!("{error:#}").trim_end()));
            match error.downcast_ref::<JobError>() {
                Some(JobError { again: true, .. }) => AGAIN.into(),
                _ => ExitCode::FAILURE,
            }
        }
    }
}

fn run_command(command: &Command) -> Result<()> {
    match command {
        Command::Import(args) if bundle::is_bundle(args) => bundle::run(args),
        Command::Import(args) => import::run(args),
        Command::Quantize { args, method } => {
            quantize::run(args, method.map(MethodArg::method).transpose()?, |_, _| String::new())
        }
        Command::Inspect(args) => inspect::run(args),
        Command::Report(args) => commands::report::run(args),
        Command::Repack(args) => commands::repack::run(args),
        Command::Eval(args) => eval::run(args),
        Command::Check(args) => commands::check::run(args),
        Command::Constants(args) => commands::constants::run(args),
        Command::ExportC(args) => commands::export_c::run(args),
        Command::Deploy(args) => commands::deploy::run(args),
        Command::Tune(args) => tune::run(args),
        Command::Plan(args) => jobs::plan::run(args),
        Command::Job(args) => jobs::job::run(args, &Host),
        Command::Merge(args) => jobs::merge::run(args),
        Command::Sweep { args, methods } => {
            let name = |method: &MethodArg| Ok(method.method()?.to_string());
            sweep::run(args, &methods.iter().map(name).collect::<Result<Vec<_>>>()?, &Host)
        }
        Command::Serve(args) => commands::serve::run(args),
        Command::Link(args) => link::run(args),
        Command::Keygen(args) => sign::keygen(args),
        Command::Sign(args) => sign::sign(args),
    }
}
