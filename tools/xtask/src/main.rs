//! The commands for users and CI: `cargo demo`, `cargo verify`, `cargo xtask bench`, `cargo xtask budgets`,
//! `cargo xtask fit`, `cargo xtask peers`, `cargo xtask compare`, `cargo xtask faults`, `cargo xtask firmware`, `cargo xtask stack`,
//! `cargo xtask capi`, `cargo xtask python`, `cargo xtask exporters`, `cargo xtask wasm`, `cargo xtask gallery`, `cargo xtask
//! doctor`.
//!
//! This crate has few dependencies, so that it builds fast and prints soon. The binaries of `actq-bench` and
//! `actq-research` measure.
#![forbid(unsafe_code)]

mod exporters;
mod firmware;
mod limits;
mod python;
mod setup;
mod verify;
mod wasm;

use std::process::ExitCode;

use actq_boards::Target;
use anyhow::{Context as _, Result, ensure};
use clap::{Args, Parser, Subcommand};

/// The profile of what these commands build for the host (see `Cargo.toml`).
const PROFILE: &str = "checks";

/// Commands of the actq workspace
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask", max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Format, lints, tests, a smoke run in QEMU
    ///
    /// Tests on policies outside this repository run if ACTQ_SHARED names their folder.
    Verify {
        /// Everything that CI checks: also the tests on every board in QEMU, those that learn for long, lints for every board,
        /// documentation, budgets, faults on the line, ONNX files against tract, the Python package, 32-bit words, the
        /// oldest compiler
        #[arg(long)]
        all: bool,
    },
    /// Check and install the other commands' requirements: Rust targets and QEMU
    Doctor,
    /// Build the motor controller for a board
    Firmware(firmware::Options),
    /// Build and test the Python package in a virtual environment below the target directory
    ///
    /// Runs its tests and checks its types. Needs Python 3.9 or later with venv: python3, or the interpreter that ACTQ_PYTHON
    /// names.
    Python(python::Options),
    /// Import policies that released packages export, and compare them with the packages' own actions
    ///
    /// Installs pinned releases of each package in an environment below the target directory, several GB with torch. Not
    /// part of CI.
    Exporters(exporters::Options),
    /// Compile the kernels to the WebAssembly module of the report and of the npm package
    Wasm(wasm::Options),
    /// Build the gallery: a page in which simulated robots are driven by images of few bits, with --out DIR
    #[command(disable_help_flag = true)]
    Gallery(Words),
    /// Quantize the UR3 policy, run it on a Cortex-M4 in QEMU in closed loop, and show cost and success
    #[command(disable_help_flag = true)]
    Demo(Words),
    /// Count the instructions of kernels and whole heads on a Cortex-M4 in QEMU and model their cycles
    #[command(disable_help_flag = true)]
    Bench(Words),
    /// Measure instructions, code, scratch and stack, and compare them with budgets.json
    #[command(disable_help_flag = true)]
    Budgets(Words),
    /// Compare the quantizer's methods: held-out error, true bits, closed-loop success
    #[command(disable_help_flag = true)]
    Compare(Words),
    /// Compare the executions of random descriptions: in f64, as images in f32 and at 8 bits, in QEMU
    #[command(disable_help_flag = true)]
    Descriptions(Words),
    /// Drive an arm through the serial port of the controller in QEMU, with faults on the line
    #[command(disable_help_flag = true)]
    Faults(Words),
    /// Compute the maximum stack of the controller from the calls in its ELF file
    #[command(disable_help_flag = true)]
    Stack(Words),
    /// Measure the cost model's rates again (after every change of the kernels)
    #[command(disable_help_flag = true)]
    Fit(Words),
    /// Measure our code and that of other projects on every core in QEMU
    #[command(disable_help_flag = true)]
    Peers(Words),
    /// Package the C interface for a core
    #[command(disable_help_flag = true)]
    Capi(Words),
}

/// Arguments for the measuring program, which shows them with --help.
#[derive(Args)]
struct Words {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, value_name = "OPTIONS")]
    words: Vec<String>,
}

fn main() -> ExitCode {
    let outcome = match Cli::parse().command {
        Command::Verify { all } => verify::run(all),
        Command::Doctor => setup::doctor(),
        Command::Firmware(options) => options.run(),
        Command::Python(options) => python::test(options),
        Command::Exporters(options) => exporters::compare(options),
        Command::Wasm(options) => wasm::run(&options),
        Command::Gallery(options) => wasm::gallery(options),
        Command::Compare(options) => measuring("actq-research", "compare", options),
        Command::Capi(options) => measure_for(Target::ALL.iter().copied(), "capi", options),
        Command::Stack(options) => measure_for(firmware::boards().map(|(target, _)| target), "stack", options),
        Command::Demo(options) => measure(&[Target::Fpu], "demo", options),
        Command::Bench(options) => measure(&[Target::Fpu], "bench", options),
        Command::Descriptions(options) => measure(&[Target::Fpu], "descriptions", options),
        Command::Faults(options) => measure(&[Target::Fpu], "faults", options),
        Command::Peers(options) => measure(
            &[Target::Fpu, Target::NoDsp, Target::V6m, Target::Riscv, Target::RiscvZb, Target::M55],
            "peers",
            options,
        ),
        Command::Fit(options) => measure(
            &[Target::Fpu, Target::NoFpu, Target::NoDsp, Target::V6m, Target::Riscv, Target::M55],
            "fit",
            options,
        ),
        Command::Budgets(options) => {
            measure(&[Target::Fpu, Target::M33, Target::NoDsp, Target::V6m, Target::Riscv], "budgets", options)
        }
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("\nerror: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// Installs the compiler's part for these targets, and runs a command of `actq-bench`.
fn measure_for(mut targets: impl Iterator<Item = Target>, command: &str, options: Words) -> Result<()> {
    targets.try_for_each(|target| setup::rust_target(target.triple()))?;
    measuring("actq-bench", command, options)
}

/// Installs the requirements of these targets, and runs a command of `actq-bench` in QEMU.
fn measure(targets: &[Target], command: &str, options: Words) -> Result<()> {
    let boards: Vec<&str> = targets.iter().map(|target| target.board().name).collect();
    println!("{command}: on {} in QEMU", boards.join(" and "));
    setup::ensure(targets)?;
    measuring("actq-bench", command, options)
}

/// Builds the binary of a package and runs one of its commands.
fn measuring(package: &str, command: &str, Words { words }: Words) -> Result<()> {
    let mut cargo = setup::cargo();
    cargo.args(["run", "--profile", PROFILE, "--package", package, "--", command]).args(words);
    println!("building {package}");
    ensure!(cargo.status().context("cannot start cargo")?.success(), "{command} failed");
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_are_read_or_refused() {
        let parse = |line: &str| Cli::try_parse_from(line.split(' ')).map(|_| ()).map_err(|error| error.to_string());
        assert_eq!(parse("xtask demo --help"), Ok(()));
        assert_eq!(parse("xtask firmware --list"), Ok(()));
        assert_eq!(parse("xtask firmware --board stm32f405 --list"), Ok(()));
        assert_eq!(parse("xtask python --optional -- -k head"), Ok(()));
        assert_eq!(parse("xtask exporters rsl_rl keras"), Ok(()));
        for (line, expected) in [
            (
                "xtask firmware --board microbit --out f.elf",
                "use one of mps2-an386, mps2-an385, mps2-an385-v6m, virt, mps2-an505, mps2-an500, stm32f405, mps3-an547",
            ),
            ("xtask firmware --board stm32f4 --list", "use one of"),
            ("xtask firmware --board stm32f405", "--out <FILE.elf>"),
            ("xtask firmware --board stm32f405 --out f.elf --key 12", "64 hexadecimal digits"),
            ("xtask verify --al", "--all"),
        ] {
            let error = parse(line).expect_err(line);
            assert!(error.contains(expected), "{line}: {error}");
        }
    }
}
