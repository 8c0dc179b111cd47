//! What people and CI type: `cargo demo`, `cargo verify`, `cargo xtask bench`, `cargo xtask fit`, `cargo xtask doctor`.
#![forbid(unsafe_code)]

mod bench;
mod demo;
mod fit;
mod setup;
mod verify;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// Commands of the actq workspace.
#[derive(Parser)]
#[command(name = "xtask", max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Quantize the UR3 policy, run it on a Cortex-M4 in QEMU in closed loop, and show what it costs and gives
    Demo {
        /// Closed-loop episodes of each policy on the host
        #[arg(long, default_value_t = 100)]
        episodes: u64,
        /// Closed-loop episodes with the firmware in QEMU as the policy
        #[arg(long, default_value_t = 20)]
        qemu_episodes: u64,
    },
    /// Count the kernels' instructions on a Cortex-M4 in QEMU and model their cycles
    Bench {
        /// Write the figures as JSON, too
        #[arg(long)]
        json: Option<PathBuf>,
    },
    /// Measure the cost model's rates anew (after every change of the kernels)
    Fit,
    /// Everything that CI checks: format, lints, documentation, tests on the host and under QEMU
    Verify,
    /// Check and install what the other commands need: Rust targets and QEMU
    Doctor,
}

fn main() -> ExitCode {
    let outcome = match Cli::parse().command {
        Command::Demo { episodes, qemu_episodes } => setup::ensure().and_then(|()| demo::run(episodes, qemu_episodes)),
        Command::Bench { json } => setup::ensure().and_then(|()| bench::run(json.as_deref())),
        Command::Fit => setup::ensure().and_then(|()| fit::run()),
        Command::Verify => setup::ensure().and_then(|()| verify::run()),
        Command::Doctor => setup::ensure().map(|()| println!("all there")),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("\nerror: {error:#}");
            ExitCode::FAILURE
        }
    }
}
