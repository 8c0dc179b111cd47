//! Descriptions of everything around a network, on the target: the bits of the host.

use std::path::Path;

use actq::runtime::ImageBuffer;
use actq_bench::Target;
use actq_bench::descriptions::{Compared, compare};
use actq_bench::profile::Harness;
use actq_bench::qemu::same_bits;
use anyhow::{Context as _, Result, ensure};

use crate::deployed::{Made, PUBLISHED, published};

/// Ticks on the host and in QEMU.
const TICKS: usize = 400;

fn single(raw: &[Vec<Vec<f64>>]) -> Vec<Vec<f32>> {
    let single = |tick: usize| raw[tick % raw.len()].iter().flatten().map(|x| *x as f32).collect();
    (0..TICKS).map(single).collect()
}

#[test]
fn every_operation_has_the_bits_of_the_host() -> Result<()> {
    let image = Made::deployment()?.1.four_bits()?;
    let raw = single(&Made::raw(TICKS));
    [Target::Fpu, Target::NoFpu, Target::M33, Target::M7]
        .into_iter()
        .try_for_each(|target| same_bits(target, &image, &raw))
}

#[test]
fn random_descriptions_have_the_bits_of_the_host() -> Result<()> {
    for seed in 2_000_000..2_000_012 {
        if let Compared::Same(image, raw) = compare(seed)? {
            same_bits(Target::Fpu, &image, &raw).with_context(|| format!("seed {seed}"))?;
        }
    }
    Ok(())
}

#[test]
fn published_bundles_have_the_bits_of_the_host() -> Result<()> {
    for (name, answers) in PUBLISHED {
        let Some((plan, deployment, reference)) = published(name, answers)? else { return Ok(()) };
        let raw = single(&reference.raw().frames(plan.inputs())?);
        same_bits(Target::Fpu, &deployment.four_bits()?, &raw)?;
        println!("{name}: {TICKS} ticks at 4 bits have the host's bits");
    }
    Ok(())
}

/// The cost model knows the operations around a network: whole steps, and polls of the least budget.
#[test]
fn steps_and_polls_match_the_prediction() -> Result<()> {
    let bytes = Made::deployment()?.1.four_bits()?;
    let raw = &single(&Made::raw(24))[..24];
    let buffer = ImageBuffer::new(&bytes);
    let image = buffer.image(Path::new("made"))?;
    let harness = Harness::build(Target::Fpu)?;
    let counted = harness.steps(&bytes, raw)?;
    let mean = counted.iter().map(|cost| cost.instructions).sum::<u64>() as f64 / counted.len() as f64;
    let error = image.step_cost().instructions as f64 / mean - 1.0;
    println!("{mean:.0} instructions a step, predicted {:+.2}%", 100.0 * error);
    ensure!(error.abs() < 0.02, "{error}");
    let least = image.least_budget();
    let (polls, _) = harness.regions(&bytes, &format!("poll {least}"), raw)?;
    // The first region of a step takes the observation.
    let longest = polls.iter().map(|cost| cost.instructions).max().context("no polls")?;
    println!("polls of {least} instructions: {} of them, {longest} at most", polls.len());
    ensure!(polls.len() > 20 * raw.len() && longest <= u64::from(least), "{longest} of {least}");
    Ok(())
}
