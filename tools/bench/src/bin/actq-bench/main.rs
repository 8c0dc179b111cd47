//! The measuring commands: `cargo demo`, `cargo xtask bench`, `cargo xtask budgets`, `cargo xtask descriptions`, `cargo xtask fit`, `cargo xtask
//! faults`, `cargo xtask stack`. xtask installs their requirements, builds this binary and runs it.
#![forbid(unsafe_code)]

mod balancer;
mod bench;
mod boards;
mod budgets;
mod demo;
mod descriptions;
mod faults;
mod fit;
#[cfg(unix)]
mod flips;
mod gallery;
mod heads;
mod kernels;
mod peers;
mod stack;
mod trials;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use actq::runtime::ImageBuffer;
use actq_bench::capi::{CORES, Core};
#[cfg(unix)]
use actq_bench::flips::Region;
use actq_kernels::cost;
use anyhow::{Context as _, Result};
use clap::{Parser, Subcommand};

/// Measure the runtime on a Cortex-M4 in QEMU
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask", max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Quantize the UR3 policy, run it on a Cortex-M4 in QEMU in closed loop, and show cost and success
    Demo {
        /// Closed-loop episodes of each policy on the host
        #[arg(long, default_value_t = 100)]
        episodes: u64,
        /// Closed-loop episodes with the firmware in QEMU as the policy
        #[arg(long, default_value_t = 20)]
        qemu_episodes: u64,
        /// Only the balancing robot, with its transformer: attention to a window of its last 16 tokens
        #[arg(long)]
        transformer: bool,
    },
    /// Count the instructions of kernels and whole heads on a Cortex-M4 in QEMU and model their cycles
    ///
    /// The heads are the UR3 policy's and, if ACTQ_SHARED names their folder, those of the shared policies.
    Bench {
        /// Also write the figures as JSON
        #[arg(long)]
        json: Option<PathBuf>,
        /// Also model a flash with N wait states behind the caches of an STM32F4; an STM32F405 at 168 MHz has 5
        #[arg(long, value_name = "N", default_value_t = 0)]
        wait_states: u64,
        /// Show the functions in which the heads spend their instructions
        #[arg(long)]
        by_function: bool,
        /// Instead, run this image on the first episode of a recording: bits, and the prediction of its time
        #[arg(long, value_name = "FILE", requires = "recording")]
        image: Option<PathBuf>,
        /// The observations for --image: .npz, .npy or .safetensors
        #[arg(long, value_name = "FILE", requires = "image")]
        recording: Option<PathBuf>,
    },
    /// Compare the executions of random descriptions: in f64, and as images in f32 and at 8 bits, also in QEMU
    Descriptions {
        /// Descriptions
        #[arg(long, default_value_t = 10_000)]
        count: u64,
        /// Seed of the first
        #[arg(long, default_value_t = 0)]
        first: u64,
        /// Descriptions whose images run in QEMU, too
        #[arg(long, default_value_t = 200)]
        qemu: u64,
    },
    /// Drive the UR3 arm through the serial port of the controller in QEMU, with faults on the line
    ///
    /// One episode of 4 s for each fault: frames lost, delayed, repeated and damaged, a cut cable, a stalled host, a
    /// reset, an update.
    Faults,
    /// Inject bit flips into the application that runs in QEMU, and class the outcomes by region
    ///
    /// Flips are uniform over the bytes of a region and over time. The same seed gives the same flips and outcomes.
    #[cfg(unix)]
    Flips {
        /// Seed of the flips
        #[arg(long, default_value_t = 1)]
        seed: u64,
        /// Flips in each region
        #[arg(long, default_value_t = 2000)]
        count: u64,
        /// Only these regions
        #[arg(long, value_name = "REGION,..", value_delimiter = ',', value_parser = region)]
        region: Vec<Region>,
        /// Print every flip with its outcome
        #[arg(long)]
        list: bool,
    },
    /// Measure instructions, code, scratch and stack, and compare them with budgets.json
    Budgets {
        /// Write the measured figures to budgets.json
        #[arg(long)]
        update: bool,
    },
    /// Compute the maximum stack of the application from the calls in its ELF file
    Stack {
        /// Build the application for this board
        #[arg(long, required_unless_present = "elf")]
        board: Option<String>,
        /// An ELF file made by `cargo xtask firmware`
        #[arg(long, conflicts_with = "board")]
        elf: Option<PathBuf>,
    },
    /// Measure networks on every core in QEMU, with our code and that of other projects
    ///
    /// Installs pinned public packages in a temporary folder, builds them and ours with gcc, clang and rustc, keeps each
    /// one's fastest form, and checks its outputs against f64. Networks: a layer of 256x256; an MLP of 48-512-256-128-12
    /// with ReLU and ELU; a GRU of 48 inputs and 128 units. Needs Python with pip, and names what else is missing.
    Peers {
        /// Only our own images, by the harness in Rust, which needs neither Python nor a C compiler nor a connection
        #[arg(long)]
        ours: bool,
        /// Keep packages and programs in this folder, and use packages that are already there
        #[arg(long, value_name = "DIR", conflicts_with = "ours")]
        folder: Option<PathBuf>,
        /// Only rows in whose core, network and peer all of these are, as: m4f CMSIS
        #[arg(conflicts_with = "ours")]
        words: Vec<String>,
        /// Write the rows as JSON: a list of objects
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
    },
    /// Build the gallery: a folder with a page in which simulated robots are driven by images of few bits
    Gallery {
        /// The folder to write
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
        /// The module of the robots, which xtask passes
        #[arg(long, value_name = "FILE.wasm", hide = true)]
        robots: PathBuf,
        /// Only the balancer at 2 bits, which learns briefly, and two reports: for tests
        #[arg(long)]
        quick: bool,
    },
    /// Measure the cost model's rates again (after every change of the kernels)
    Fit {
        /// The cores
        #[arg(long, value_name = "CORE,..", value_delimiter = ',', default_value = "m4f,m4,m3,m0,rv32imac,rv32zb,m55", value_parser = core)]
        core: Vec<cost::Core>,
        /// Only the items of the model, and only the images, with this word in their names: `attention`
        #[arg(long, value_name = "WORD")]
        only: Option<String>,
    },
    /// Package the C interface: header, static library, files for build systems, licences and a manifest
    Capi {
        /// The core: cortex-m0plus, cortex-m3, cortex-m4, cortex-m4f, cortex-m7, cortex-m33, rv32imac or host
        #[arg(long, value_name = "CORE")]
        target: String,
        /// A new folder for the package, or a new file F.zip
        #[arg(long, value_name = "DIR|F.zip")]
        out: PathBuf,
        /// Leave out what this image does not need: widths, operations, functions. The library refuses images that need
        /// it
        #[arg(long, value_name = "F.actq")]
        image: Option<PathBuf>,
        /// Use shorter loops: up to 1.8 KB of code less, up to 13 % more time, the same bits (not on cores without the
        /// assembler: cortex-m0plus, cortex-m3, rv32imac, host)
        #[arg(long)]
        compact: bool,
    },
}

/// Reads the name of a core.
fn core(name: &str) -> Result<cost::Core, String> {
    cost::Core::of_name(name).ok_or_else(|| format!("use one of {}", cost::Core::ALL.map(|(name, _)| name).join(", ")))
}

/// Reads the name of a region.
#[cfg(unix)]
fn region(name: &str) -> Result<Region, String> {
    let known = Region::ALL.map(|region| region.to_string());
    let found = Region::ALL.into_iter().find(|region| region.to_string() == name);
    found.ok_or_else(|| format!("use one of {}", known.join(", ")))
}

/// Packages the C interface for a core.
fn capi(core: &str, out: &Path, image: Option<&Path>, compact: bool) -> Result<()> {
    let names: Vec<_> = CORES.iter().map(|core| core.name).collect();
    let known = Core::of(core);
    let known = known.with_context(|| format!("--target {core}: use one of {}", names.join(", ")))?;
    match image {
        None => known.package(out, None, compact)?,
        Some(path) => known.package(out, Some(&ImageBuffer::read(path)?.image(path)?), compact)?,
    }
    println!("{}: the C interface for {core}; build with {}", out.display(), known.flags.join(" "));
    Ok(())
}

fn main() -> ExitCode {
    let outcome = match Cli::parse().command {
        Command::Demo { episodes, qemu_episodes, transformer: true } => demo::transformer(episodes, qemu_episodes),
        Command::Demo { episodes, qemu_episodes, .. } => demo::run(episodes, qemu_episodes),
        Command::Descriptions { count, first, qemu } => descriptions::run(first, count, qemu),
        Command::Faults => faults::all(),
        #[cfg(unix)]
        Command::Flips { seed, count, region, list } => {
            flips::run(seed, count, if region.is_empty() { &Region::ALL } else { &region }, list)
        }
        Command::Bench { image: Some(image), recording: Some(recording), .. } => bench::image(&image, &recording),
        Command::Bench { json, wait_states, by_function, .. } => bench::run(json.as_deref(), wait_states, by_function),
        Command::Budgets { update } => budgets::run(update),
        Command::Fit { core, only } => fit::run(&core, only.as_deref()),
        Command::Gallery { out, robots, quick } => gallery::build(&out, &robots, quick),
        Command::Peers { ours, folder, words, json } => peers::run(ours, &words, folder.as_deref(), json.as_deref()),
        Command::Capi { target, out, image, compact } => capi(&target, &out, image.as_deref(), compact),
        Command::Stack { board: Some(board), .. } => stack::of_board(&board),
        Command::Stack { elf, .. } => stack::show(&elf.unwrap_or_default()),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("\nerror: {error:#}");
            ExitCode::FAILURE
        }
    }
}
