//! Sliced steps on the host: the same bits in any slicing, and the interplay of begin, step, poll and reset.

use std::path::Path;
use std::task::Poll;

use actq::emit;
use actq::graph::ops::Linear;
use actq::methods::{Activations, Outcome};
use actq::policy::Policy;
use actq::runtime::{ImageBuffer, with_head};
use actq_bench::bits;
use actq_bench::golden::Random;
use actq_bench::networks::{Builder, Draw, with_wrong_self_test};
use actq_kernels::{Head, StepError, Width};
use anyhow::{Context, Result, ensure};
use proptest::prelude::*;

const OBSERVATION: usize = 37;
/// Steps of a run.
const STEPS: usize = 7;

/// A network of all operations, with a step limit.
fn network(seed: u64) -> Result<(Policy, Vec<Outcome>)> {
    let (mut policy, outcomes) = Draw::new(seed).network(OBSERVATION)?;
    policy.contract.max_step = Some(vec![0.3; policy.act_len]);
    Ok((policy, outcomes))
}

fn on_head<T>(seed: u64, work: impl FnOnce(&mut Head<'_, '_>) -> Result<T>) -> Result<T> {
    let (policy, outcomes) = network(seed)?;
    let buffer = ImageBuffer::new(&emit::image(&policy, &outcomes)?);
    with_head::<_, anyhow::Error>(buffer.image(Path::new("slices"))?, work)
}

fn observations(seed: u64) -> Vec<Vec<f32>> {
    let mut random = Random::new(seed);
    (0..STEPS).map(|_| (0..OBSERVATION).map(|_| random.normal()).collect()).collect()
}

/// Returns the actions of whole steps.
pub(crate) fn whole(head: &mut Head<'_, '_>, observations: &[Vec<f32>]) -> Result<Vec<Vec<u32>>> {
    observations.iter().map(|obs| Ok(bits(head.step(obs)?))).collect()
}

/// Returns the action from polls with the budgets of `budget`, and the number of polls.
pub(crate) fn in_polls(
    head: &mut Head<'_, '_>,
    obs: &[f32],
    mut budget: impl FnMut() -> u32,
) -> Result<(Vec<u32>, usize)> {
    head.begin(obs)?;
    for polls in 1..100_000 {
        if let Poll::Ready(action) = head.poll(budget())? {
            return Ok((bits(action), polls));
        }
    }
    anyhow::bail!("no action after the maximum of polls")
}

/// Does some polls of a step, and leaves it unfinished.
fn part_of_a_step(head: &mut Head<'_, '_>, obs: &[f32], polls: usize) -> Result<()> {
    let budget = head.image().least_budget();
    head.begin(obs)?;
    for _ in 0..polls {
        ensure!(head.poll(budget)?.is_pending(), "the step is too short for this test");
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn any_slicing_gives_the_same_bits(seed in any::<u64>(), spread in 1u32..20_000) {
        let observations = observations(seed);
        let outcome = on_head(seed, |head| {
            let expected = whole(head, &observations)?;
            head.reset();
            let least = head.image().least_budget();
            let mut random = Random::new(seed);
            let mut cut = 0;
            for (obs, expected) in observations.iter().zip(&expected) {
                let (action, polls) = in_polls(head, obs, || least + random.below(spread as usize) as u32)?;
                ensure!(action == *expected, "the bits differ in polls of {least} and up to {spread} more");
                cut = cut.max(polls);
            }
            // The least budget slices finest, also between operations.
            head.reset();
            for (obs, expected) in observations.iter().zip(&expected) {
                let (action, polls) = in_polls(head, obs, || least)?;
                ensure!(action == *expected, "the bits differ in polls of the least budget, {least}");
                cut = cut.max(polls);
            }
            ensure!(cut > 1, "the step was not sliced");
            Ok(())
        });
        prop_assert!(outcome.is_ok(), "{outcome:?}");
    }
}

/// A seed whose network has a cell, no chunks, and work for a dozen polls of the least budget; or one without a cell.
fn seed(recurrent: bool) -> Result<u64> {
    let suits = |seed: &u64| {
        on_head(*seed, |head| {
            let fits = head.image().execute() == 1 && (head.image().state().len > 0) == recurrent;
            let least = head.image().least_budget();
            Ok(fits && in_polls(head, &observations(*seed)[0], || least)?.1 > 6)
        })
        .unwrap_or(false)
    };
    (0..400).find(suits).context("no seed gives a suitable network")
}

/// Runs `work` with a head of such a network, and observations.
pub(crate) fn on_sliced(
    recurrent: bool,
    work: impl FnOnce(&mut Head<'_, '_>, &[Vec<f32>]) -> Result<()>,
) -> Result<()> {
    let seed = seed(recurrent)?;
    on_head(seed, |head| work(head, &observations(seed)))
}

#[test]
fn ready_stays_ready_until_the_next_begin() -> Result<()> {
    on_sliced(true, |head, observations| {
        let (action, _) = in_polls(head, &observations[0], || u32::MAX)?;
        for _ in 0..3 {
            let Poll::Ready(again) = head.poll(head.image().least_budget())? else { anyhow::bail!("pending") };
            ensure!(bits(again) == action, "the action changed without a step");
        }
        // The polls in between were no steps.
        let second = bits(head.step(&observations[1])?);
        head.reset();
        ensure!(whole(head, &observations[..2])? == [action, second]);
        Ok(())
    })
}

#[test]
fn a_poll_without_a_step_is_an_error() -> Result<()> {
    on_sliced(true, |head, observations| {
        assert_eq!(head.poll(u32::MAX), Err(StepError::NotBegun));
        part_of_a_step(head, &observations[0], 2)?;
        head.reset();
        assert_eq!(head.poll(u32::MAX), Err(StepError::NotBegun), "a reset drops the step");
        head.infer(&observations[0])?;
        assert_eq!(head.poll(u32::MAX), Err(StepError::NotBegun), "infer gives no action");
        Ok(())
    })
}

#[test]
fn a_budget_below_the_least_changes_nothing() -> Result<()> {
    on_sliced(true, |head, observations| {
        let expected = whole(head, &observations[..2])?;
        head.reset();
        head.step(&observations[0])?;
        part_of_a_step(head, &observations[1], 2)?;
        let needed = head.image().least_budget();
        for given in [0, 1, needed - 1] {
            assert_eq!(head.poll(given), Err(StepError::Budget { needed, given }));
        }
        let Poll::Ready(action) = head.poll(u32::MAX)? else { anyhow::bail!("pending") };
        ensure!(bits(action) == expected[1], "the refused polls changed the state");
        Ok(())
    })
}

#[test]
fn a_dropped_step_leaves_nothing_behind() -> Result<()> {
    // Without a recurrent state, the next action equals that without the dropped step, including the step limit.
    on_sliced(false, |head, observations| {
        let expected = whole(head, &observations[..2])?;
        for polls in 0..5 {
            head.reset();
            head.step(&observations[0])?;
            part_of_a_step(head, &observations[3], polls)?;
            ensure!(bits(head.step(&observations[1])?) == expected[1], "dropped after {polls} polls");
        }
        Ok(())
    })?;
    // A recurrent state is reset if a poll has worked on it.
    on_sliced(true, |head, observations| {
        let expected = whole(head, &observations[..2])?;
        head.reset();
        let fresh = bits(head.infer(&observations[1])?);
        head.reset();
        head.step(&observations[0])?;
        let carried = bits(head.infer(&observations[1])?);
        ensure!(fresh != carried, "the state has no effect here");
        for polls in 0..5 {
            head.reset();
            head.step(&observations[0])?;
            part_of_a_step(head, &observations[3], polls)?;
            if polls == 0 {
                head.begin(&observations[1])?;
                let Poll::Ready(action) = head.poll(u32::MAX)? else { anyhow::bail!("pending") };
                ensure!(bits(action) == expected[1], "a step without polls changed the state");
            } else {
                ensure!(bits(head.infer(&observations[1])?) == fresh, "dropped after {polls} polls");
            }
        }
        Ok(())
    })
}

#[test]
fn an_error_resets() -> Result<()> {
    on_sliced(true, |head, observations| {
        let expected = whole(head, &observations[..1])?;
        part_of_a_step(head, &observations[2], 3)?;
        let bad = vec![f32::NAN; OBSERVATION];
        assert_eq!(head.begin(&bad), Err(StepError::ObservationNotFinite { index: 0 }));
        assert_eq!(head.poll(u32::MAX), Err(StepError::NotBegun));
        ensure!(whole(head, &observations[..1])? == expected, "the head was not reset");
        Ok(())
    })?;
    // Finite, but too large for two products: the error comes from a poll.
    let mut builder = Builder::new(OBSERVATION);
    let width = |_| Some(Width::W8);
    let hidden = builder.linear((64, OBSERVATION), Activations::Int8, width, 0, true)?;
    let matrix = builder.matrix(3, 64, Activations::Int8, &[Some(Width::W8); 3], 0)?;
    builder.node(Linear { matrix, bias: vec![0.0; 3] }, &[hidden])?;
    let buffer = ImageBuffer::new(&builder.image("overflow")?);
    with_head::<_, anyhow::Error>(buffer.image(Path::new("overflow"))?, |head| {
        let observations = observations(1);
        let expected = whole(head, &observations[..1])?;
        head.begin(&[f32::MAX; OBSERVATION])?;
        let least = head.image().least_budget();
        let error = loop {
            match head.poll(least) {
                Ok(Poll::Pending) => {}
                other => break other.map(|_| ()),
            }
        };
        assert_eq!(error, Err(StepError::NotFinite));
        assert_eq!(head.poll(u32::MAX), Err(StepError::NotBegun));
        ensure!(whole(head, &observations[..1])? == expected, "the head was not reset");
        Ok(())
    })
}

#[test]
fn single_operation_polls_end_after_each_operation() -> Result<()> {
    on_sliced(true, |head, observations| {
        head.begin(&observations[0])?;
        for op in 0..head.image().op_count() {
            ensure!(head.poll_op(u32::MAX)?.is_pending(), "ready before operation {op}");
        }
        ensure!(head.poll_op(u32::MAX)?.is_ready(), "not ready after the last operation");
        Ok(())
    })
}

/// As in one piece: it passes with the least budget and more, and detects a wrong action at its step.
#[test]
fn a_sliced_self_test_is_the_same_test() -> Result<()> {
    for seed in 0..4 {
        let (policy, outcomes) = network(seed)?;
        let bytes = emit::image(&policy, &outcomes)?;
        let in_pieces = |bytes: &[u8], budget, most| {
            let buffer = ImageBuffer::new(bytes);
            with_head::<_, anyhow::Error>(buffer.image(Path::new("slices"))?, |head| {
                let mut pieces = 0;
                let whole = head.self_test();
                let passed = head.self_test_in_slices(budget, || {
                    pieces += 1;
                    pieces <= most
                });
                Ok((passed, whole, pieces, head.image().self_test_steps()))
            })
        };
        let (passed, whole, finest, steps) = in_pieces(&bytes, 0, usize::MAX)?;
        assert_eq!((passed, whole), (Ok(()), Ok(())));
        let (passed, _, coarsest, _) = in_pieces(&bytes, u32::MAX, usize::MAX)?;
        assert_eq!((passed, coarsest), (Ok(()), steps));
        let (passed, _, pieces, _) = in_pieces(&bytes, 0, finest - 1)?;
        assert_eq!((passed, pieces), (Err(StepError::Stale), finest), "it ends where it is told to");
        assert!(finest > 2 * steps, "{finest} pieces of {steps} steps");
        let (refused, whole, ..) = in_pieces(&with_wrong_self_test(&bytes)?, 0, usize::MAX)?;
        assert_eq!((refused, whole), (Err(StepError::SelfTest { step: 0 }), Err(StepError::SelfTest { step: 0 })));
    }
    Ok(())
}
