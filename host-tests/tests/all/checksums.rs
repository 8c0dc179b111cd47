//! Bits that flip in scratch memory, with the kernels' feature `checksums`: during a long product and between two steps
//! each is found, or changes nothing.

use std::path::Path;

use actq::graph::ops::{Add, Linear, RmsNorm};
use actq::methods::Activations;
use actq::runtime::{ImageBuffer, with_head};
use actq_bench::bits;
use actq_bench::golden::Random;
use actq_bench::networks::Builder;
use actq_kernels::{Head, StepError, Width};
use anyhow::{Result, ensure};

use crate::slices::{on_sliced, whole};

/// Length of the hidden layers: their product is a long one.
const HIDDEN: usize = 512;
const OBSERVATION: usize = 32;
/// Polls within an operation after which its input is prepared.
const PREPARED: usize = 4;

/// Returns the image of a residual network with a norm, whose second product is from and to [`HIDDEN`] values.
fn image() -> Result<Vec<u8>> {
    let mut builder = Builder::new(OBSERVATION);
    let widths = |row| Some(if row < HIDDEN / 2 { Width::W2 } else { Width::W4 });
    let hidden = builder.linear((HIDDEN, OBSERVATION), Activations::Int8, widths, 0, true)?;
    let widths: Vec<_> = (0..HIDDEN).map(widths).collect();
    let matrix = builder.matrix(HIDDEN, HIDDEN, Activations::Int8, &widths, 0)?;
    let bias = builder.values(HIDDEN);
    let normed = builder.node(RmsNorm { weight: vec![1.0; HIDDEN], eps: 1e-3 }, &[hidden])?;
    let product = builder.node(Linear { matrix, bias }, &[normed])?;
    let sum = builder.node(Add, &[product, hidden])?;
    let matrix = builder.matrix(3, HIDDEN, Activations::Int8, &[Some(Width::W8); 3], 0)?;
    builder.node(Linear { matrix, bias: vec![0.0; 3] }, &[sum])?;
    builder.image("checksums")
}

/// Runs polls of the least budget until one ends in operation `op` after [`PREPARED`] + `more` others did; returns
/// `false` if none does.
fn poll_into(head: &mut Head<'_, '_>, op: usize, more: usize) -> Result<bool> {
    let budget = head.image().least_budget();
    let mut inside = 0;
    while head.poll(budget)?.is_pending() {
        inside += usize::from(head.next_op() == Some(op));
        if inside > PREPARED + more {
            return Ok(true);
        }
    }
    Ok(false)
}

#[test]
fn a_flip_during_a_long_product_is_found_or_changes_nothing() -> Result<()> {
    let buffer = ImageBuffer::new(&image()?);
    let image = buffer.image(Path::new("checksums"))?;
    let product = image.ops().position(|op| op.src().len == HIDDEN && op.matrix().is_some());
    let product = product.unwrap_or_default();
    let regions = image.ops().nth(product).map(|op| [op.dst(), op.src(), op.third()]).unwrap_or_default();
    with_head::<_, anyhow::Error>(image, |head| {
        let mut random = Random::new(1);
        let observation: Vec<f32> = (0..OBSERVATION).map(|_| random.normal()).collect();
        let expected = bits(head.step(&observation)?);
        // Found in the outputs, in the work area, and elsewhere.
        let (mut found, mut more) = ([0; 3], 0);
        loop {
            head.begin(&observation)?;
            if !poll_into(head, product, more)? {
                break;
            }
            more += 16;
            for word in 0..head.arena().len() {
                head.begin(&observation)?;
                ensure!(poll_into(head, product, more - 16)?);
                head.arena_mut()[word] ^= 1 << random.below(32);
                let outcome = head.poll(u32::MAX).map(|action| action.map(bits));
                match outcome {
                    Ok(action) => ensure!(action == std::task::Poll::Ready(expected.clone()), "word {word}"),
                    Err(error) => {
                        ensure!(error == StepError::Damaged, "{error}");
                        let [outputs, _, work] = regions.map(|region| region.range().contains(&word));
                        found[if outputs { 0 } else { 2 - usize::from(work) }] += 1;
                    }
                }
            }
        }
        ensure!(more > 32 && found.iter().all(|&count| count > 100), "{found:?} after {more} polls");
        Ok(())
    })
}

#[test]
fn a_flip_between_two_steps_is_found_or_changes_nothing() -> Result<()> {
    on_sliced(true, |head, observations| {
        let mut random = Random::new(2);
        let expected = whole(head, observations)?;
        let (words, mut found) = (head.arena().len(), 0);
        for word in 0..words {
            head.reset();
            head.step(&observations[0])?;
            head.arena_mut()[word] ^= 1 << random.below(32);
            match head.step(&observations[1]).map(bits) {
                Ok(action) => ensure!(action == expected[1], "word {word}"),
                Err(error) => {
                    ensure!(error == StepError::Damaged, "{error}");
                    found += 1;
                    // It goes on without the state.
                    head.step(&observations[1])?;
                }
            }
        }
        ensure!(found >= head.image().state().len, "{found} flips of {words} words were found");
        Ok(())
    })
}
