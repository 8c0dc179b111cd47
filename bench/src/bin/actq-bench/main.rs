//! The commands that measure: `cargo demo`, `cargo xtask bench`, `cargo xtask budgets`, `cargo xtask fit`,
//! `cargo xtask faults`, `cargo xtask compare`, `cargo xtask stack`. xtask installs what they need, builds this binary
//! and runs it.
#![forbid(unsafe_code)]

mod bench;
mod boards;
mod budgets;
mod demo;
mod faults;
mod fit;
mod heads;
mod kernels;
mod stack;

use std::path::PathBuf;
use std::process::ExitCode;

use actq_bench::compare::{self, Plan};
use clap::{Parser, Subcommand};

/// What the runtime costs on a Cortex-M4 in QEMU, and what the quantizer gives.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask", max_term_width = 100)]
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
    /// Count the instructions of kernels and whole heads on a Cortex-M4 in QEMU and model their cycles
    ///
    /// The heads are that of the UR3 policy and, where ACTQ_SHARED names their folder, those of the shared policies.
    Bench {
        /// Write the figures as JSON, too
        #[arg(long)]
        json: Option<PathBuf>,
        /// Also model a flash with so many wait states behind the caches of an STM32F4; an STM32F405 at 168 MHz has 5
        #[arg(long, value_name = "N", default_value_t = 0)]
        wait_states: u64,
        /// Show in which functions the heads spend their instructions
        #[arg(long)]
        by_function: bool,
    },
    /// Drive the UR3's arm through the serial port of the controller in QEMU, with faults on the line
    ///
    /// One episode of 4 s for each fault: frames lost, late, twice and damaged, a cut cable, a host that stalls, a
    /// reset, an update.
    Faults,
    /// Measure instructions, code, scratch and stack, and compare them with budgets.json
    Budgets {
        /// Write what was measured to budgets.json
        #[arg(long)]
        update: bool,
    },
    /// Show the most stack that the application can take, from the calls in its ELF file
    Stack {
        /// Build it for this board
        #[arg(long, required_unless_present = "elf")]
        board: Option<String>,
        /// A file that `cargo xtask firmware` has made
        #[arg(long, conflicts_with = "board")]
        elf: Option<PathBuf>,
    },
    /// Measure the cost model's rates anew (after every change of the kernels)
    Fit,
    /// Compare the methods at equal budgets: held-out error, true bits, closed-loop success
    ///
    /// The policies are that of the UR3 and, where ACTQ_SHARED names their folder, the shared ones. Their tasks run in
    /// MuJoCo with the Python of ACTQ_MUJOCO_PYTHON (go1_*, g1_*) and ACTQ_GYMNASIUM_PYTHON (fetch_*). Every result
    /// stands in DIR/compare.jsonl at once: the same command goes on where it was ended. The report is DIR/compare.md.
    Compare(Plan),
}

fn main() -> ExitCode {
    let outcome = match Cli::parse().command {
        Command::Demo { episodes, qemu_episodes } => demo::run(episodes, qemu_episodes),
        Command::Faults => faults::all(),
        Command::Bench { json, wait_states, by_function } => bench::run(json.as_deref(), wait_states, by_function),
        Command::Budgets { update } => budgets::run(update),
        Command::Fit => fit::run(),
        Command::Stack { board: Some(board), .. } => stack::of_board(&board),
        Command::Stack { elf, .. } => stack::show(&elf.unwrap_or_default()),
        Command::Compare(plan) => compare::run(&plan),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("\nerror: {error:#}");
            ExitCode::FAILURE
        }
    }
}
