//! Attention on every core: the host's bits, and the predicted cost.

use actq::runtime::{ImageBuffer, with_head};
use actq_bench::profile::Harness;
use actq_bench::{Target, bits};
use actq_kernels::cost::Rates;
use actq_kernels::image::Cache;
use actq_testkit::Random;
use anyhow::{Result, ensure};

use crate::attention::{Attention, Prefixed};
use crate::draft::Draft;

/// Largest relative error of a predicted step, of which attention is the most.
const ERROR: f64 = 0.015;

/// Returns observations for a ring that wraps around, some of them large or zero.
fn observations(attention: &Attention, random: &mut Random) -> Vec<Vec<f32>> {
    let len: usize = attention.lengths().iter().sum();
    let steps = if attention.is_ring { attention.cache.slots + 3 } else { 3 };
    let mut of_size = |size: f32| (0..len).map(|_| size * random.unit()).collect();
    (0..steps).map(|step| of_size([1.0, 30.0, 1e-20, 0.0][step % 4])).collect()
}

/// Attentions of every kind: heads that share, columns and slots that are not multiples of a word's.
fn attentions() -> Vec<Attention> {
    let mut random = Random::new(11);
    let cache = Cache { heads: 2, dim: 9, slots: 7, own: 0 };
    let ring =
        Attention { heads: 6, cache, tokens: 1, is_ring: true, is_causal: false, is_rotated: false, factor: 0.3 };
    let wide = Attention { heads: 2, cache: Cache { heads: 1, dim: 64, slots: 5, own: 0 }, is_rotated: true, ..ring };
    let whole = Attention { tokens: 4, is_ring: false, is_causal: true, ..ring };
    let drawn = (0..5).map(|_| Attention::draw(&mut random));
    [ring, wide, whole].into_iter().chain(drawn).collect()
}

#[test]
fn every_core_has_the_hosts_bits() -> Result<()> {
    for target in [Target::Fpu, Target::NoFpu, Target::NoDsp, Target::V6m, Target::Riscv, Target::M55] {
        let harness = Harness::build_with(target, "attention")?;
        let mut random = Random::new(12);
        for attention in attentions() {
            let (image, observations) = (Draft(attention.image()), observations(&attention, &mut random));
            let (_, actions) = harness.regions(image.bytes(), "serve", &observations)?;
            let (_, in_polls) = harness.regions(image.bytes(), "poll 20000", &observations)?;
            let buffer = ImageBuffer::new(image.bytes());
            with_head::<_, anyhow::Error>(buffer.image("attention".as_ref())?, |head| {
                for ((observation, action), sliced) in observations.iter().zip(&actions).zip(&in_polls) {
                    let expected = bits(head.step(observation)?);
                    ensure!(bits(action) == expected, "{target:?}: {attention:?}");
                    ensure!(bits(sliced) == expected, "{target:?}, in polls: {attention:?}");
                }
                Ok(())
            })?;
        }
    }
    Ok(())
}

/// Every core runs the self-test at its start, and the harness keeps its prefix.
#[test]
fn every_core_has_the_hosts_bits_of_a_prefix() -> Result<()> {
    for target in [Target::Fpu, Target::NoFpu, Target::NoDsp, Target::V6m, Target::Riscv, Target::M55] {
        let harness = Harness::build_with(target, "attention")?;
        let mut random = Random::new(14);
        for _ in 0..2 {
            let prefixed = Prefixed::draw(&mut random);
            let observations: Vec<Vec<f32>> =
                (0..3).map(|_| (0..prefixed.obs_len()).map(|_| random.unit()).collect()).collect();
            let image = Draft(prefixed.image());
            let buffer = ImageBuffer::new(image.bytes());
            let least = buffer.image("prefix".as_ref())?.least_budget();
            let (_, actions) = harness.regions(image.bytes(), "serve", &observations)?;
            let (_, in_polls) = harness.regions(image.bytes(), &format!("poll {least}"), &observations)?;
            let (_, restarted) = harness.regions(image.bytes(), "restart", &observations)?;
            with_head::<_, anyhow::Error>(buffer.image("prefix".as_ref())?, |head| {
                head.set_test_prefix();
                for (i, observation) in observations.iter().enumerate() {
                    let expected = bits(head.step(observation)?);
                    let found = [&actions, &in_polls, &restarted].map(|run| bits(&run[i]));
                    ensure!(found.iter().all(|bits| *bits == expected), "{target:?}: {prefixed:?}");
                }
                Ok(())
            })?;
        }
    }
    Ok(())
}

/// The width of a token, in heads and columns: 192.
const HEADS: usize = 4;
const COLUMNS: usize = 48;

/// Returns a token's attention to a ring of this many slots.
fn context(slots: usize) -> Attention {
    let cache = Cache { heads: HEADS, dim: COLUMNS, slots, own: 0 };
    Attention { heads: HEADS, cache, tokens: 1, is_ring: true, is_causal: false, is_rotated: false, factor: 0.15 }
}

/// A step with a full ring: it costs a constant, and a constant for each token of the context.
#[test]
fn the_cost_grows_with_the_context() -> Result<()> {
    let harness = Harness::build_with(Target::Fpu, "attention")?;
    let (mut counted, mut wrong) = (Vec::new(), Vec::new());
    for slots in [1, 2, 4, 8, 16, 32, 64] {
        let attention = context(slots);
        let mut random = Random::new(13);
        let len: usize = attention.lengths().iter().sum();
        let observations: Vec<Vec<f32>> = (0..slots + 2).map(|_| (0..len).map(|_| random.unit()).collect()).collect();
        let image = Draft(attention.image());
        let costs = harness.steps(image.bytes(), &observations)?;
        let step = costs[slots + 1].instructions;
        let buffer = ImageBuffer::new(image.bytes());
        let predicted = Rates::M4F.of_step(&buffer.image("attention".as_ref())?).instructions;
        let error = predicted as f64 / step as f64 - 1.0;
        let text = format!("{slots} tokens: {step} instructions, {predicted} predicted: {:+.2}%", 1e2 * error);
        println!("{text}");
        wrong.extend((error.abs() >= ERROR).then_some(text));
        counted.push((slots, step));
    }
    ensure!(wrong.is_empty(), "{wrong:?}");
    // The products of a token are 2 * 192 MACs. Exponentials and scales take as much again.
    let [.., (half, of_half), (all, of_all)] = counted[..] else { unreachable!("seven contexts") };
    let macs = 2 * HEADS * COLUMNS * (all - half);
    let each = (of_all - of_half) as f64 / macs as f64;
    println!("{each:.2} instructions per MAC of a longer context");
    ensure!(each < 2.0 * 1.1, "{each:.2} instructions per MAC");
    Ok(())
}
