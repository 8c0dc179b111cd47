//! Descriptions of everything around a network, on the target: the bits of the host.

use actq_bench::Target;
use anyhow::Result;

use super::qemu::same_bits;
use crate::deployed::{Made, PUBLISHED, four_bits, published};

/// Ticks on the host and in QEMU.
const TICKS: usize = 1000;

fn single(raw: &[Vec<Vec<f64>>]) -> Vec<Vec<f32>> {
    let single = |tick: usize| raw[tick % raw.len()].iter().flatten().map(|x| *x as f32).collect();
    (0..TICKS).map(single).collect()
}

#[test]
fn every_operation_has_the_bits_of_the_host() -> Result<()> {
    let image = four_bits(&Made::deployment()?.1.policy)?;
    let raw = single(&Made::raw(TICKS));
    [Target::Fpu, Target::NoFpu, Target::M33, Target::M7]
        .into_iter()
        .try_for_each(|target| same_bits(target, &image, &raw))
}

#[test]
fn published_bundles_have_the_bits_of_the_host() -> Result<()> {
    for (name, answers) in PUBLISHED {
        let Some((plan, deployment, reference)) = published(name, answers)? else { return Ok(()) };
        let raw = single(&reference.raw().frames(plan.inputs())?);
        same_bits(Target::Fpu, &four_bits(&deployment.policy)?, &raw)?;
        println!("{name}: {TICKS} ticks at 4 bits have the host's bits");
    }
    Ok(())
}
