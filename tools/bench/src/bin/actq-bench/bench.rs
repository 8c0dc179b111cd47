//! `cargo xtask bench`: kernels, whole heads and users' images on the Cortex-M4, counted and modelled.

use std::path::Path;

use actq::data::{Dataset, Sizes};
use actq::error::Error;
use actq::measure::time::CLOCK;
use actq::runtime::{ImageBuffer, with_head};
use actq_bench::profile::Harness;
use actq_bench::qemu::Counter;
use actq_bench::{Target, bits};
use actq_kernels::cost::Cost;
use anyhow::{Context, Result, ensure};
use serde::Serialize;

use crate::{heads, kernels};

/// The content of the JSON file.
#[derive(Serialize)]
#[serde(untagged)]
enum Entry<'a> {
    Kernel(&'a kernels::Record),
    Head(&'a heads::Record),
}

pub(crate) fn run(json: Option<&Path>, wait_states: u64, by_function: bool) -> Result<()> {
    let counter = Counter::build()?;
    let kernels = kernels::measure(&counter, wait_states)?;
    println!(
        "\nWhole calls on the Cortex-M4: QEMU counts instructions, cycles are modelled\n\n{}",
        kernels::report(&kernels, None)
    );
    let heads = heads::measure(&heads::policies(), &counter, wait_states)?;
    println!("\nWhole heads: a step that evaluates the network\n\n{}", heads::report(&heads));
    println!("\nTheir instructions per MAC, by kind\n\n{}", heads::report_kinds(&heads));
    if by_function {
        println!("\nTheir instructions, by function\n\n{}", heads::report_functions(&heads));
    }
    if wait_states > 0 {
        println!(
            "\nwith waits: a model of flash with {wait_states} wait states behind the caches of an STM32F4 (docs/KERNELS.md)"
        );
    }
    if let Some(path) = json {
        let kernels = kernels.iter().map(Entry::Kernel);
        let all: Vec<Entry<'_>> = kernels.chain(heads.iter().map(|head| Entry::Head(&head.record))).collect();
        std::fs::write(path, serde_json::to_string_pretty(&all)? + "\n")
            .with_context(|| format!("cannot write {}", path.display()))?;
    }
    Ok(())
}

/// The feature that the harness of other images does not have.
const ATTENTION: &str = "attention";

/// Runs an image on the first episode of a recording, compares its actions with the host's, and the cost of its steps with
/// the prediction.
pub(crate) fn image(path: &Path, recording: &Path) -> Result<()> {
    let buffer = ImageBuffer::read(path)?;
    let image = buffer.image(path)?;
    let recorded = Dataset::load(recording, Sizes::of_image(&image))?;
    let frames: Vec<Vec<f32>> = recorded.episode(0).map(|row| row[..image.obs_len()].to_vec()).collect();
    let needs_attention = image.features().any(|feature| feature == ATTENTION);
    let harness = match needs_attention {
        true => Harness::build_with(Target::Fpu, ATTENTION)?,
        false => Harness::build(Target::Fpu)?,
    };
    let (costs, actions) = harness.regions(buffer.bytes(), "serve", &frames)?;
    let expected: Vec<Vec<f32>> = with_head(image, |head| {
        frames.iter().map(|frame| Ok(head.step(frame)?.to_vec())).collect::<Result<_, Error>>()
    })?;
    let other = actions.iter().zip(&expected).position(|(found, expected)| bits(found) != bits(expected));
    ensure!(other.is_none(), "step {}: another action than on the host", other.unwrap_or(0));
    println!("{} actions have the host's bits, on a Cortex-M4 with FPU in QEMU", actions.len());
    let evaluations: Vec<Cost> = costs.into_iter().step_by(image.execute()).collect();
    let mean = evaluations.iter().map(|cost| cost.instructions).sum::<u64>() as f64 / evaluations.len() as f64;
    let predicted = image.step_cost();
    println!(
        "{mean:.0} instructions in a step that evaluates the network, the mean of {}; predicted {} ({:+.2} %)",
        evaluations.len(),
        predicted.instructions,
        100.0 * (predicted.instructions as f64 / mean - 1.0)
    );
    let cycles = evaluations.iter().map(|cost| cost.cycles).max().unwrap_or(0);
    println!("{:.3} ms at {} MHz at most, modelled", 1e3 * cycles as f64 / CLOCK, CLOCK / 1e6);
    Ok(())
}
