//! The commands for users and CI: `cargo demo`, `cargo verify`, `cargo xtask bench`, `cargo xtask budgets`,
//! `cargo xtask fit`, `cargo xtask compare`, `cargo xtask faults`, `cargo xtask firmware`, `cargo xtask stack`,
//! `cargo xtask capi`, `cargo xtask python`, `cargo xtask doctor`.
//!
//! This crate has few dependencies, so that it builds fast and prints soon. The binaries of `actq-bench` and
//! `actq-research` measure.
#![forbid(unsafe_code)]

mod firmware;
mod limits;
mod python;
mod setup;
mod verify;

use std::process::ExitCode;

use actq_boards::Target;
use anyhow::{Context as _, Result, ensure};

/// The profile of what these commands build for the host (see `Cargo.toml`).
const PROFILE: &str = "checks";

const USAGE: &str = "\
Commands of the actq workspace. Usage: cargo xtask COMMAND

  demo     Quantize the UR3 policy, run it on a Cortex-M4 in QEMU in closed loop, and show cost and success
  bench    Count the instructions of kernels and whole heads on a Cortex-M4 in QEMU and model their cycles
  budgets  Measure instructions, code, scratch and stack, and compare them with budgets.json
  compare  Compare the quantizer's methods: held-out error, true bits, closed-loop success
  descriptions
           Compare the executions of random descriptions: in f64, as images in f32 and at 8 bits, in QEMU
  firmware Build the motor controller for a board: --board NAME [--image F.actq] --out FILE.elf; --list shows the boards
  faults   Drive an arm through the serial port of the controller in QEMU, with faults on the line
  stack    Compute the maximum stack of the controller from the calls in its ELF file: --board NAME, or --elf FILE
  fit      Measure the cost model's rates again (after every change of the kernels)
  verify   Format, lints, tests, a smoke run in QEMU; with --all everything that CI checks
  capi     Package the C interface: --target CORE --out DIR [--image F.actq] [--compact]
  python   Build and test the Python package in a virtual environment; --optional with torch
  doctor   Check and install the other commands' requirements: Rust targets and QEMU

demo, verify, bench, budgets, capi, compare, descriptions, faults, fit, firmware, python and stack show their options with --help.";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    // An error of the outer result is of the command line, one of the inner result of the work.
    let outcome = match &words[..] {
        ["verify", options @ ..] => verify::Options::parse(options).map(|options| options.run()),
        ["doctor"] => Ok(setup::ensure(&Target::ALL).map(|()| println!("nothing is missing"))),
        ["firmware", options @ ..] => firmware::Options::parse(options).map(|options| options.run()),
        ["python", options @ ..] => python::Options::parse(options).map(|options| options.run()),
        ["compare", ..] => Ok(measuring("actq-research", &words)),
        ["capi", ..] => Ok(measure_for(Target::ALL.iter().copied(), &words)),
        ["stack", ..] => Ok(measure_for(firmware::boards().map(|(target, _)| target), &words)),
        ["demo" | "bench" | "descriptions" | "faults" | "fit", ..] => Ok(measure(&words, &[Target::Fpu])),
        ["budgets", ..] => Ok(measure(&words, &[Target::Fpu, Target::M33])),
        ["help" | "-h" | "--help"] => {
            println!("{USAGE}");
            Ok(Ok(()))
        }
        _ => Err(USAGE.to_owned()),
    };
    match outcome {
        Ok(Ok(())) => ExitCode::SUCCESS,
        Ok(Err(error)) => {
            eprintln!("\nerror: {error:#}");
            ExitCode::FAILURE
        }
        Err(wrong) => {
            eprintln!("{wrong}");
            ExitCode::from(2)
        }
    }
}

/// Installs the compiler's part for these targets, and runs a command of `actq-bench`.
fn measure_for(mut targets: impl Iterator<Item = Target>, arguments: &[&str]) -> Result<()> {
    targets.try_for_each(|target| setup::rust_target(target.triple()))?;
    measuring("actq-bench", arguments)
}

/// Installs the requirements of these targets, and runs a command of `actq-bench` in QEMU.
fn measure(arguments: &[&str], targets: &[Target]) -> Result<()> {
    let boards: Vec<&str> = targets.iter().map(|target| target.board().name).collect();
    println!("{}: on {} in QEMU", arguments[0], boards.join(" and "));
    setup::ensure(targets)?;
    measuring("actq-bench", arguments)
}

/// Builds the binary of a package and runs one of its commands.
fn measuring(package: &str, arguments: &[&str]) -> Result<()> {
    let mut command = setup::cargo();
    command.args(["run", "--profile", PROFILE, "--package", package, "--"]).args(arguments);
    println!("building {package}");
    ensure!(command.status().context("cannot start cargo")?.success(), "{} failed", arguments[0]);
    Ok(())
}
