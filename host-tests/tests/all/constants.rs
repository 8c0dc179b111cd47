//! Operations with equal constants share them in an image, and run the same bits as with copies.

use actq::emit;
use actq::error::Cause;
use actq::graph::ops::LayerNorm;
use actq::methods::Activations;
use actq::runtime::{ImageBuffer, with_head};
use actq_bench::networks::Builder;
use actq_kernels::image::{header as h, seal};
use actq_kernels::{ImageError, Width};
use anyhow::{Context, Result};

const LEN: usize = 32;
/// Words of a layer norm's constants.
const CONSTANTS: usize = 1 + 2 * LEN;

/// Three layer norms of a vector: the second with its own constants, the others with equal ones.
fn image() -> Result<Vec<u8>> {
    let mut builder = Builder::new(LEN);
    let last = builder.linear((LEN, LEN), Activations::Int8, |_| Some(Width::W4), 0, true)?;
    let (weight, bias) = (builder.values(LEN), vec![0.25; LEN]);
    let mut value = last;
    for sign in [1.0, -1.0, 1.0] {
        let weight = weight.iter().map(|w| sign * w).collect();
        value = builder.node(LayerNorm { weight, bias: bias.clone(), eps: 1e-5 }, &[value])?;
    }
    let (policy, outcomes) = builder.finish("shared".to_owned(), false);
    Ok(emit::image(&policy, &outcomes)?)
}

fn words(bytes: &[u8]) -> Vec<u32> {
    bytes.as_chunks().0.iter().map(|word| u32::from_le_bytes(*word)).collect()
}

fn sealed(words: &[u32]) -> Result<Vec<u8>> {
    let mut bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    seal(&mut bytes).context("cannot seal the image: it is too long")?;
    Ok(bytes)
}

/// Position of the constants in the last operation's record.
fn last_data(words: &[u32]) -> usize {
    let count = (words[h::W_KIND] >> 16) as usize;
    words[h::W_OPS] as usize + (count - 1) * h::OP_WORDS + 3
}

/// The image with a second copy of the last operation's constants, before the operation records.
fn with_its_own(bytes: &[u8]) -> Result<Vec<u8>> {
    let mut words = words(bytes);
    let at = words[h::W_OPS] as usize;
    let data = words[last_data(&words)] as usize;
    let constants: Vec<u32> = words[data..][..CONSTANTS].to_vec();
    words.splice(at..at, constants);
    for offset in [h::W_OPS, h::W_CONTRACT, h::W_NAME, h::W_SELF_TEST] {
        words[offset] += CONSTANTS as u32;
    }
    let last = last_data(&words);
    words[last] = at as u32;
    sealed(&words)
}

#[test]
fn shared_constants_save_bytes_and_keep_the_bits() -> Result<()> {
    let shared = image()?;
    let own = with_its_own(&shared)?;
    assert_eq!(shared.len() + 4 * CONSTANTS, own.len());
    let run = |bytes: &[u8]| {
        let buffer = ImageBuffer::new(bytes);
        with_head::<_, anyhow::Error>(buffer.image("memory".as_ref())?, |head| {
            head.self_test()?;
            let observation = |step: usize| (0..LEN).map(|i| ((7 * i + step) as f32).sin()).collect::<Vec<f32>>();
            (0..8).map(|step| Ok(head.step(&observation(step))?.iter().map(|v| v.to_bits()).collect())).collect()
        })
    };
    let (a, b): (Vec<Vec<u32>>, Vec<Vec<u32>>) = (run(&shared)?, run(&own)?);
    assert_eq!(a, b);
    Ok(())
}

#[test]
fn only_earlier_constants_can_be_shared() -> Result<()> {
    let plain = words(&image()?);
    let last = last_data(&plain);
    // The check has not seen half of these.
    let behind = plain[h::W_OPS] as usize - LEN;
    for data in [behind, h::WORDS] {
        let mut words = plain.clone();
        words[last] = data as u32;
        let bytes = sealed(&words)?;
        let refused = ImageBuffer::new(&bytes).image("memory".as_ref()).map(|_| ());
        let error = refused.expect_err("expected a refusal of these constants");
        assert!(matches!(error.cause(), Cause::Image(ImageError::Section)), "{data}: {error:#}");
    }
    Ok(())
}
