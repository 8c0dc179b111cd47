//! The cost model's predictions against QEMU's counts, and the polls of a step against their budget.

use std::path::Path;

use actq::budget::{Budget, TimeLimit};
use actq::contract::{Ensemble, Playback};
use actq::data::{Dataset, Recordings, Sizes};
use actq::emit;
use actq::measure::time::{CLOCK, StepTime};
use actq::methods::{Activations, Method, Options};
use actq::pipeline::{Quantizer, quantize};
use actq::policy::Policy;
use actq::random::Random;
use actq::runtime::{ImageBuffer, with_head};
use actq_bench::networks::Builder;
use actq_bench::profile::Harness;
use actq_bench::qemu;
use actq_bench::{Target, bits, shared_policies, ur3};
use actq_kernels::cost::{Core, Cost, Rates};
use actq_kernels::image::Kind;
use actq_kernels::{StepError, Width};
use anyhow::{Context, Result, bail, ensure};

/// Steps of each image, spread over the held-out recordings.
const STEPS: usize = 24;
/// Largest relative error of a predicted step.
const ERROR: f64 = 0.01;

/// Returns some of the recorded frames: they and learning change the weights' values, on which no time depends.
fn recordings(policy: &Policy) -> Result<Recordings> {
    const FRAMES: usize = 1000;
    let all = Recordings::load(policy)?.calib.context("a recording")?;
    let calib = all.thinned(FRAMES, policy.graph.state_len() > 0).into_owned();
    Ok(Recordings { calib: Some(calib), heldout: None })
}

pub(super) fn image(policy: &Policy, options: &Options) -> Result<Vec<u8>> {
    Ok(quantize(policy, &recordings(policy)?, options, ())?.image)
}

pub(super) fn distill(bits: f64) -> Options {
    Options { steps: Some(2), ..Options::new(Method::Distill, Budget::BitsPerWeight(bits)) }
}

fn rtn(width: Width, group: usize, activations: Activations) -> Options {
    Options { group, activations, ..Options::new(Method::Rtn, Budget::Width(width)) }
}

pub(super) fn observations(dir: &Path, policy: &Policy) -> Result<Vec<Vec<f32>>> {
    let dataset = Dataset::load(&dir.join("heldout.npz"), Sizes::of(policy))?;
    let all: Vec<Vec<f32>> = (0..dataset.length.len()).flat_map(|e| dataset.episode(e)).collect();
    ensure!(all.len() >= STEPS, "too few recorded observations");
    Ok(all.iter().step_by(all.len() / STEPS).take(STEPS).cloned().collect())
}

/// Compares a predicted cost with the mean of counted ones, up to a relative error; returns the mean of the
/// instructions.
fn near(what: &str, predicted: Cost, counted: &[Cost], limit: f64) -> Result<f64> {
    let mean = |of: fn(&Cost) -> u64| counted.iter().map(of).sum::<u64>() as f64 / counted.len() as f64;
    let instructions = mean(|c| c.instructions);
    for (unit, predicted, counted) in
        [("instructions", predicted.instructions, instructions), ("cycles", predicted.cycles, mean(|c| c.cycles))]
    {
        let error = predicted as f64 / counted - 1.0;
        let text = format!("{what}: {predicted} {unit}, {counted:.0} counted: {:+.2}%", 1e2 * error);
        println!("{text}");
        ensure!(error.abs() < limit, "{text}");
    }
    Ok(instructions)
}

/// Predicts the step of every image, and compares with the mean over recorded observations. Returns the counted
/// instructions per weight of the f32 policy.
fn predictions_hold(dir: &Path, images: &[Options]) -> Result<Vec<f64>> {
    let harness = Harness::build(Target::Fpu)?;
    let policy = Policy::load(dir)?;
    let observations = observations(dir, &policy)?;
    let mut per_mac = Vec::new();
    for options in images {
        let bytes = image(&policy, options)?;
        let buffer = ImageBuffer::new(&bytes);
        let image = buffer.image(dir)?;
        let counted: Vec<Cost> = harness.steps(&bytes, &observations)?;
        let evaluated: Vec<Cost> = counted.iter().step_by(image.execute()).copied().collect();
        let predicted = Rates::M4F.of_step(&image);
        let instructions = near(&format!("{}, {options:?}", policy.name), predicted, &evaluated, ERROR)?;
        let time = StepTime::new(&image, Core::M4f, CLOCK);
        ensure!(time.cycles == predicted.cycles && time.instructions == predicted.instructions, "{time:?}");
        per_mac.push(instructions / policy.weights as f64);
    }
    Ok(per_mac)
}

/// Chunks that are averaged, and chunks that blend into the next, of other sizes than those of the fit.
#[test]
fn steps_that_merge_chunks_match_the_prediction() -> Result<()> {
    let harness = Harness::build(Target::Fpu)?;
    const OBSERVATION: usize = 24;
    let mut random = Random::new(6);
    let observations: Vec<Vec<f32>> = (0..STEPS).map(|_| (0..OBSERVATION).map(|_| random.normal()).collect()).collect();
    for (chunk, act_len, horizon, overlap) in
        [(12, 4, 12, 0), (30, 7, 9, 0), (40, 14, 40, 0), (12, 4, 0, 9), (40, 14, 0, 30)]
    {
        let mut builder = Builder::new(OBSERVATION);
        builder.linear((chunk * act_len, OBSERVATION), Activations::Int8, |_| Some(Width::W3), 0, true)?;
        let (mut policy, outcomes) =
            builder.finish(format!("chunks of {chunk}, horizon {horizon}, overlap {overlap}"), false);
        (policy.kind, policy.chunk, policy.act_len) = (Kind::Chunk, chunk, act_len);
        let ensemble = (horizon > 0).then_some(Ensemble { horizon, m: 0.1 });
        policy.contract.playback = Playback { ensemble, overlap, deadline: None };
        let bytes = emit::image(&policy, &outcomes)?;
        let buffer = ImageBuffer::new(&bytes);
        let predicted = Rates::M4F.of_step(&buffer.image(Path::new("chunks"))?);
        // Before the second chunk there is none to blend with.
        let counted = &harness.steps(&bytes, &observations)?[1..];
        near(&policy.name, predicted, counted, 0.03)?;
    }
    Ok(())
}

/// Whole steps of rtn images, with groups and without, and of the method distill.
fn images() -> Vec<Options> {
    vec![
        distill(2.0),
        distill(3.0),
        rtn(Width::W4, 32, Activations::Int8),
        rtn(Width::W8, 32, Activations::Int8),
        rtn(Width::W4, 64, Activations::Int16),
        rtn(Width::W8, 0, Activations::Int16),
    ]
}

#[test]
fn ur3_steps_match_the_prediction() -> Result<()> {
    predictions_hold(&ur3(), &images()).map(drop)
}

#[test]
fn steps_of_shared_policies_match_the_prediction() -> Result<()> {
    let Some(policies) = shared_policies() else { return Ok(()) };
    // Limit of the instructions per MAC of the whole head at 3 bits.
    for (name, limit) in [("go1_mlp", 1.25), ("g1_lstm256", 1.30), ("fetch_pickplace", 1.25)] {
        let others = [distill(2.0), rtn(Width::W3, 32, Activations::Int8), rtn(Width::W8, 0, Activations::Int16)];
        let per_mac = predictions_hold(&policies.join(name), &[&[distill(3.0)], &others[..]].concat())?;
        ensure!(per_mac[0] <= limit, "{name}: {:.3} instructions per MAC, limit {limit}", per_mac[0]);
    }
    Ok(())
}

/// Runs every image in polls of several budgets, which depend on the image's least one: each poll stays within its
/// budget, and the actions have the host's bits. Returns the number of budgets that were not below the least.
pub(super) fn polls_keep_their_budget(
    harness: &Harness,
    dir: &Path,
    images: &[Options],
    budgets: impl Fn(u32) -> Vec<u32>,
) -> Result<usize> {
    let policy = Policy::load(dir)?;
    let observations = observations(dir, &policy)?;
    let mut tried = 0;
    for options in images {
        let bytes = image(&policy, options)?;
        let buffer = ImageBuffer::new(&bytes);
        let image = buffer.image(dir)?;
        let expected = with_head(image, |head| {
            observations[..4].iter().map(|obs| Ok(head.step(obs)?.to_vec())).collect::<Result<Vec<_>>>()
        })?;
        for budget in budgets(image.least_budget()) {
            let at = || format!("{}, {options:?} in polls of {budget}", policy.name);
            let arguments = format!("poll {budget}");
            if budget < image.least_budget() {
                let slot = qemu::slot(&bytes)?;
                let command = qemu::command(&harness.elf, Some(slot.path()), &arguments)?;
                let output = qemu::run(command, &qemu::step_request(&observations[0]))?;
                let refusal = StepError::Budget { needed: image.least_budget(), given: budget };
                let stderr = String::from_utf8_lossy(&output.stderr);
                ensure!(!output.status.success() && output.stdout.is_empty(), "{}: {output:?}", at());
                ensure!(stderr.trim_end() == format!("firmware: step: {refusal}"), "{}: {stderr}", at());
                continue;
            }
            let run = harness.regions(&bytes, &arguments, &observations[..4]);
            let (costs, actions) = run.with_context(at)?;
            ensure!(bits(&actions.concat()) == bits(&expected.concat()), "{}: other bits", at());
            let largest = costs.iter().map(|c| c.instructions).max().unwrap_or(0);
            let all: u64 = costs.iter().map(|c| c.instructions).sum();
            println!("{}: {} polls, the largest {largest}, in all {all}", at(), costs.len());
            ensure!(largest <= u64::from(budget), "{}: {largest} instructions", at());
            tried += 1;
        }
    }
    Ok(tried)
}

/// Budgets of an image with this least one.
fn budgets(least: u32) -> Vec<u32> {
    vec![2_000, 5_000, 20_000, least]
}

#[test]
fn polls_stay_within_their_budget() -> Result<()> {
    // A host's least budget counts checksums.
    let harness = Harness::build_with(Target::Fpu, "checksums")?;
    let tried = polls_keep_their_budget(&harness, &ur3(), &images(), budgets)?;
    ensure!(tried >= 10, "only {tried} budgets were not below the least");
    Ok(())
}

#[test]
fn polls_of_shared_policies_stay_within_their_budget() -> Result<()> {
    let Some(policies) = shared_policies() else { return Ok(()) };
    let harness = Harness::build_with(Target::Fpu, "checksums")?;
    for name in ["go1_mlp", "g1_lstm256", "fetch_pickplace"] {
        let images = [distill(2.0), rtn(Width::W4, 32, Activations::Int8)];
        polls_keep_their_budget(&harness, &policies.join(name), &images, budgets)?;
    }
    Ok(())
}

#[test]
fn a_budget_of_time_is_kept_and_used() -> Result<()> {
    let policy = Policy::load(&ur3())?;
    let recordings = recordings(&policy)?;
    let quantizer = Quantizer::new(&policy, &recordings, Method::Distill, None, |_| {})?;
    let within = |milliseconds| {
        let budget = Budget::Time(TimeLimit { milliseconds, core: Core::M4f, clock_hz: CLOCK, image_bytes: None });
        quantizer.quantize(&Options { budget, ..distill(1.0) }, ())
    };
    for milliseconds in [1.6, 2.4] {
        let found = within(milliseconds)?;
        let step = StepTime::new(&found.buffer().image(Path::new("memory"))?, Core::M4f, CLOCK);
        assert_eq!(found.time.map(|time| time.cycles), Some(step.cycles));
        assert!(step.milliseconds <= milliseconds, "{} ms for a budget of {milliseconds}", step.milliseconds);
        assert!(step.milliseconds > 0.97 * milliseconds, "{} ms for a budget of {milliseconds}", step.milliseconds);
    }
    let refused = within(0.01).map(|_| ()).expect_err("no head is so fast");
    assert!(refused.to_string().contains("the fastest step takes"), "{refused}");
    Ok(())
}

/// Counts a matrix with rows of all widths against matrices of its blocks only; with the rows of a width in sequence,
/// and scattered, so that they need an index.
#[test]
fn mixed_widths_cost_little_more_than_their_blocks() -> Result<()> {
    const ROWS: usize = 64;
    const COLS: usize = 256;
    let harness = Harness::build(Target::Fpu)?;
    for activations in [Activations::Int8, Activations::Int16] {
        let mut builder = Builder::new(COLS);
        let linear = |builder: &mut Builder, rows, widths: &dyn Fn(usize) -> Width| {
            builder.linear((rows, COLS), activations, |row| Some(widths(row)), 0, true)
        };
        for width in Width::ALL {
            linear(&mut builder, ROWS, &|_| width)?;
        }
        linear(&mut builder, 4 * ROWS, &|row| Width::ALL[row / ROWS])?;
        linear(&mut builder, 4 * ROWS, &|row| Width::ALL[row % 4])?;
        let bytes = builder.image("mixed")?;
        let buffer = ImageBuffer::new(&bytes);
        let image = buffer.image(Path::new("mixed"))?;
        let observation = (0..COLS).map(|i| (i as f32).sin()).collect();
        let parts = harness.parts(&image, &bytes, &[observation], u32::MAX)?.remove(0);
        let linear = image.ops().zip(&parts.ops).filter(|(op, _)| op.matrix().is_some());
        let counts: Vec<u64> = linear.map(|(_, cost)| cost.instructions).collect();
        let [alone @ .., in_order, stepped] = &counts[..] else { bail!("{counts:?}") };
        let alone: u64 = alone.iter().sum();
        println!("{activations:?}: blocks alone {alone}, in order {in_order}, stepped {stepped}");
        ensure!(*in_order as f64 <= 1.03 * alone as f64, "{in_order} in order, {alone} alone");
        ensure!(*stepped as f64 <= 1.03 * alone as f64, "{stepped} with steps, {alone} alone");
    }
    Ok(())
}

/// Biases added to the content of an output: no graph lowers to such an operation, but an image may have it.
#[test]
fn polls_that_add_biases_stay_within_their_budget() -> Result<()> {
    const ROWS: usize = 1000;
    const COLS: usize = 8;
    let harness = Harness::build(Target::Fpu)?;
    let mut builder = Builder::new(COLS);
    for _ in 0..2 {
        builder.linear((ROWS, COLS), Activations::Int8, |_| Some(Width::W2), 0, true)?;
    }
    builder.part(2)?;
    let bytes = builder.accumulating("biases")?;
    let buffer = ImageBuffer::new(&bytes);
    let image = buffer.image(Path::new("biases"))?;
    let observations = [(0..COLS).map(|i| (i as f32).sin()).collect::<Vec<_>>()];
    for budget in [image.least_budget(), 2 * image.least_budget()] {
        let (costs, _) = harness.regions(&bytes, &format!("poll {budget}"), &observations)?;
        let largest = costs.iter().skip(1).map(|c| c.instructions).max().unwrap_or(0);
        println!("{} polls of {budget}, the largest {largest}", costs.len() - 1);
        ensure!(largest <= u64::from(budget), "{largest} instructions in a poll with budget {budget}");
    }
    let parts = harness.parts(&image, &bytes, &observations, u32::MAX)?.remove(0);
    let linear = image.ops().zip(&parts.ops).filter(|(op, _)| op.matrix().is_some());
    for (op, counted) in linear {
        near(&format!("{:?}", op.kind), Rates::M4F.of_op(&op), &[*counted], 0.03)?;
    }
    Ok(())
}
