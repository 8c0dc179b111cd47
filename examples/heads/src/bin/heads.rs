//! The cost of the heads: bytes, memory, instructions, time, polls.
#![forbid(unsafe_code)]

use std::path::{Path, PathBuf};

use actq::budget::Budget;
use actq::data::Recordings;
use actq::measure::time::{CLOCK, StepTime};
use actq::methods::{Method, Options};
use actq::pipeline::quantize;
use actq::runtime::{ImageBuffer, with_head};
use actq_cli::report::table::table;
use actq_heads::{Head, octo, oft};
use actq_kernels::cost::Core;
use actq_kernels::{Image, Width};
use anyhow::Result;
use clap::Parser;

/// The controller's flash for the head: 1 MB without the program's 64 KB.
const FLASH: usize = (1 << 20) - PROGRAM_FLASH;
const PROGRAM_FLASH: usize = 64 << 10;
/// Its contiguous RAM for the head: 128 KB without 16 KB for the rest.
const RAM: usize = (128 << 10) - OTHER_RAM;
const OTHER_RAM: usize = 16 << 10;
/// Ticks of the control loop per second.
const TICKS: f64 = 1000.0;

/// Prints the cost of heads of published sizes on a Cortex-M4 at 168 MHz, by the cost model of `actq inspect`. Their
/// weights are seeded random numbers: sizes and times are real, accuracy is not.
#[derive(Parser)]
struct Arguments {
    /// Also write each head's policy folder here.
    #[arg(long)]
    out: Option<PathBuf>,
}

fn main() -> Result<()> {
    let arguments = Arguments::parse();
    println!("Seeded random weights: sizes and times are real, accuracy is not.");
    println!(
        "rtn, one scale a row at 8 bits, in groups of 32 below; flash: 1 MB less {} KB of program; RAM: 128 KB less {} KB.",
        PROGRAM_FLASH >> 10,
        OTHER_RAM >> 10
    );
    println!("Slices: pieces of a chunk below a tick of 1 kHz, of the least budget and of half a tick's cycles.");
    let full = oft::weights(oft::HIDDEN);
    println!(
        "\noft_{}, the true size: {full} weights, never made; its codes alone at 2 bits: {} bytes",
        oft::HIDDEN,
        full / 4
    );
    for head in [octo::head(384, octo::STEPS)?, octo::head(768, octo::STEPS)?, oft::head(256)?, oft::head(128)?] {
        if let Some(out) = &arguments.out {
            head.write(&out.join(head.json["name"].as_str().unwrap_or("head")))?;
        }
        println!("\n{}", report(&head)?);
    }
    Ok(())
}

/// Prints a head's table.
fn report(head: &Head) -> Result<String> {
    let policy = head.policy()?;
    let mut rows = table(&[
        "bits",
        "image bytes",
        "flash",
        "scratch bytes",
        "RAM",
        "instructions",
        "ms",
        "slices",
        "of half a tick",
    ]);
    for width in [Width::W8, Width::W4, Width::W3, Width::W2] {
        // Rows of thousands of columns may overflow int32 with 8 bits and scales in groups.
        let group = if width == Width::W8 { 0 } else { 32 };
        let options = Options { group, ..Options::new(Method::Rtn, Budget::Width(width)) };
        let buffer = ImageBuffer::new(&quantize(&policy, &Recordings::default(), &options, ())?.image);
        let image = buffer.image(Path::new("memory"))?;
        let time = StepTime::new(&image, Core::M4f, CLOCK);
        let half = 0.5 * CLOCK / TICKS * time.instructions as f64 / time.cycles as f64;
        let fits = |fits: bool| if fits { "fits" } else { "no" }.to_owned();
        let scratch = 4 * image.scratch_words();
        rows.add_row([
            width.bits().to_string(),
            image.bytes().to_string(),
            fits(image.bytes() <= FLASH),
            scratch.to_string(),
            fits(scratch <= RAM),
            time.instructions.to_string(),
            format!("{:.1}", time.milliseconds),
            slices(image, time.least_budget)?,
            slices(image, half as u32)?,
        ]);
    }
    let (name, parameters) = (&policy.name, policy.parameters);
    Ok(format!("{name}: {} weights, {} bytes in f32\n{rows}", policy.weights, 4 * parameters))
}

/// Counts the polls of a chunk with a budget in instructions.
fn slices(image: Image<'_>, budget: u32) -> Result<String> {
    if budget < image.least_budget() {
        return Ok("-".to_owned());
    }
    with_head(image, |head| {
        head.begin(&vec![0.5; image.obs_len()])?;
        let mut polls = 1;
        while head.poll(budget)?.is_pending() {
            polls += 1;
        }
        Ok(polls.to_string())
    })
}
