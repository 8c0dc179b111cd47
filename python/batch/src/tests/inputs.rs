//! Input that a batch refuses, and heads that fail.

use std::error::Error as _;

use actq::random::Random;
use actq_bench::bits;
use actq_kernels::{ImageError, SavedError, StepError};
use anyhow::Result;

use super::{images, with_heads};
use crate::{Batch, Error};

const HEADS: usize = 70;

fn batch() -> Result<(Batch, Vec<f32>, Vec<f32>)> {
    let batch = Batch::new(&images::products(1)?, HEADS)?;
    let mut random = Random::new(1);
    let observations = (0..HEADS * batch.obs_len()).map(|_| random.unit()).collect();
    let actions = vec![7.0; HEADS * batch.act_len()];
    Ok((batch, observations, actions))
}

#[test]
fn invalid_images_and_empty_batches_are_refused() -> Result<()> {
    let image = images::products(1)?;
    assert_eq!(Batch::new(&[], 1).err(), Some(Error::Image(ImageError::TooShort)));
    assert_eq!(Batch::new(&image[1..], 1).err().map(|error| error.source().is_some()), Some(true));
    assert_eq!(Batch::new(&image, 0).err(), Some(Error::NoHeads));
    for heads in [usize::MAX, usize::MAX / 4096, isize::MAX as usize / 4] {
        assert_eq!(Batch::new(&image, heads).err(), Some(Error::Memory { heads }));
    }
    // At any alignment.
    let shifted: Vec<u8> = [0].into_iter().chain(image.iter().copied()).collect();
    assert_eq!(Batch::new(&shifted[1..], 3)?.heads(), 3);
    Ok(())
}

#[test]
fn wrong_lengths_change_nothing() -> Result<()> {
    let (mut batch, observations, mut actions) = batch()?;
    let (values, act) = (observations.len(), actions.len());
    let given = values - 1;
    assert_eq!(
        batch.step(&observations[1..], None, &mut actions),
        Err(Error::Observations { expected: values, given })
    );
    assert_eq!(
        batch.step(&observations, None, &mut actions[1..]),
        Err(Error::Actions { expected: act, given: act - 1 })
    );
    let reset = [true; HEADS + 1];
    assert_eq!(
        batch.step(&observations, Some(&reset), &mut actions),
        Err(Error::Reset { expected: HEADS, given: HEADS + 1 })
    );
    assert_eq!(batch.seed(&[1, 2]), Err(Error::Seeds { expected: HEADS, given: 2 }));
    assert!(actions.iter().all(|action| *action == 7.0));
    Ok(())
}

#[test]
fn one_impossible_observation_changes_no_head() -> Result<()> {
    let mut batch = Batch::new(&images::around(1)?, HEADS)?;
    let len = batch.obs_len();
    let observations = vec![0.5; HEADS * len];
    let mut actions = vec![7.0; HEADS * batch.act_len()];
    let mut with = |at: usize, value: f32, batch: &mut Batch| {
        let mut wrong = observations.clone();
        wrong[at] = value;
        let error = batch.step(&wrong, Some(&[true; HEADS]), &mut actions);
        assert!(actions.iter().all(|action| *action == 7.0));
        error
    };
    let [head, index] = [HEADS - 1, len - 1];
    let at = head * len + index;
    for value in [f32::NAN, f32::INFINITY] {
        let error = StepError::ObservationNotFinite { index };
        assert_eq!(with(at, value, &mut batch), Err(Error::Head { head, error }));
    }
    let error = StepError::ObservationRange { index };
    assert_eq!(with(at, -1.5 * images::RANGE, &mut batch), Err(Error::Head { head, error }));
    // The states are those of a batch that never had such a step.
    let mut fresh = Batch::new(&images::around(1)?, HEADS)?;
    let mut expected = actions.clone();
    for _ in 0..3 {
        batch.step(&observations, None, &mut actions)?;
        fresh.step(&observations, None, &mut expected)?;
        assert_eq!(bits(&actions), bits(&expected));
        let _ = batch.step(&vec![f32::NAN; HEADS * len], Some(&[true; HEADS]), &mut actions);
    }
    Ok(())
}

#[test]
fn heads_that_fail_leave_the_others_alone() -> Result<()> {
    let bytes = images::fragile()?;
    let mut batch = Batch::new(&bytes, HEADS)?;
    with_heads(&bytes, HEADS, |image, heads| {
        let mut random = Random::new(1);
        for step in 0..12 {
            let mut observations: Vec<f32> = (0..HEADS * image.obs_len()).map(|_| random.unit()).collect();
            if step % 3 == 1 {
                for head in [3, 4, 66] {
                    observations[head * image.obs_len()] = 95.0;
                }
            }
            let mut actions = vec![7.0; HEADS * image.act_len()];
            let found = batch.step(&observations, None, &mut actions);
            let rows = actions.chunks_exact(image.act_len()).zip(observations.chunks_exact(image.obs_len()));
            let mut first = None;
            for (head, (single, (action, observation))) in heads.iter_mut().zip(rows).enumerate() {
                match single.step(observation) {
                    Ok(expected) => assert_eq!(bits(action), bits(expected), "head {head}, step {step}"),
                    Err(error) => {
                        assert!(action.iter().all(|value| value.is_nan()), "head {head}, step {step}");
                        first = first.or(Some(Error::Head { head, error }));
                    }
                }
            }
            assert_eq!(found.err(), first, "step {step}");
            assert_eq!(first.is_some(), step % 3 == 1);
        }
        Ok(())
    })
}

#[test]
fn errors_name_what_was_wrong() {
    let error = Error::Head { head: 3, error: StepError::ObservationNotFinite { index: 2 } };
    assert!(error.to_string().starts_with("head 3: "), "{error}");
    assert!(error.source().is_some());
    let error = Error::Actions { expected: 4, given: 3 };
    assert!(error.to_string().contains('4') && error.source().is_none(), "{error}");
}

#[test]
fn a_batch_moves_between_threads() {
    fn check<T: Send + Sync>() {}
    check::<Batch>();
    check::<Error>();
}

#[test]
fn restored_states_go_on_with_the_same_bits() -> Result<()> {
    let (mut batch, observations, mut actions) = batch()?;
    let heads = batch.heads();
    batch.seed(&(0..heads as u32).collect::<Vec<_>>())?;
    batch.step(&observations, None, &mut actions)?;
    let saved = batch.save()?;
    let mut next = actions.clone();
    batch.step(&observations, None, &mut next)?;
    let after = batch.save()?;
    batch.reset();
    // One damaged row restores nothing.
    let before = batch.save()?;
    let mut damaged = saved.clone();
    *damaged.last_mut().expect("there are bytes") ^= 1;
    let error = batch.restore(&damaged).expect_err("it is damaged");
    assert_eq!(error, Error::Saved { head: heads - 1, error: SavedError::Damaged });
    assert_eq!(batch.save()?, before);
    let (expected, given) = (saved.len(), saved.len() - 1);
    assert_eq!(batch.restore(&saved[1..]).expect_err("it is short"), Error::States { expected, given });
    batch.restore(&saved)?;
    batch.step(&observations, None, &mut actions)?;
    assert_eq!(
        actions.iter().map(|a| a.to_bits()).collect::<Vec<_>>(),
        next.iter().map(|a| a.to_bits()).collect::<Vec<_>>()
    );
    assert_eq!(batch.save()?, after);
    Ok(())
}
