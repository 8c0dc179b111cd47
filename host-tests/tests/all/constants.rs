//! Operations with equal constants share them in an image, and run the same bits as with copies.

use actq::graph::ops::LayerNorm;
use actq::methods::Activations;
use actq::runtime::{ImageBuffer, with_head};
use actq_bench::bits;
use actq_bench::networks::Builder;
use actq_kernels::image::{header as h, op};
use actq_kernels::{ImageError, Width};
use anyhow::Result;

use crate::draft::Draft;

const LEN: usize = 32;
/// Words of a layer norm's constants.
const CONSTANTS: usize = 1 + 2 * LEN;
/// The last of the layer norms.
const LAST: (u8, usize) = (op::LAYER_NORM, 2);

/// Three layer norms of a vector: the second with its own constants, the others with equal ones.
fn image() -> Result<Draft> {
    let mut builder = Builder::new(LEN);
    let last = builder.linear((LEN, LEN), Activations::Int8, |_| Some(Width::W4), 0, true)?;
    let (weight, bias) = (builder.values(LEN), vec![0.25; LEN]);
    let mut value = last;
    for sign in [1.0, -1.0, 1.0] {
        let weight = weight.iter().map(|w| sign * w).collect();
        value = builder.node(LayerNorm { weight, bias: bias.clone(), eps: 1e-5 }, &[value])?;
    }
    Ok(Draft::of(&builder.image("shared")?))
}

/// The image with a second copy of the last operation's constants, before the operation records.
fn with_its_own(mut image: Draft) -> Draft {
    let (at, data) = (image.offset(h::W_OPS), image.data(LAST));
    let constants = image.0[data..][..CONSTANTS].to_vec();
    image.0.splice(at..at, constants);
    for offset in [h::W_OPS, h::W_CONTRACT, h::W_NAME, h::W_SELF_TEST] {
        image.set(offset, image.get(offset) + CONSTANTS as u32);
    }
    image.set(image.op(LAST) + 3, at as u32);
    image.set(h::W_BYTES, image.bytes().len() as u32);
    image.seal();
    image
}

#[test]
fn shared_constants_save_bytes_and_keep_the_bits() -> Result<()> {
    let shared = image()?;
    let own = with_its_own(shared.clone());
    assert_eq!(shared.0.len() + CONSTANTS, own.0.len());
    let run = |image: &Draft| {
        let buffer = ImageBuffer::new(image.bytes());
        with_head::<_, anyhow::Error>(buffer.image("memory".as_ref())?, |head| {
            head.self_test()?;
            let observation = |step: usize| (0..LEN).map(|i| ((7 * i + step) as f32).sin()).collect::<Vec<f32>>();
            (0..8).map(|step| Ok(bits(head.step(&observation(step))?))).collect::<Result<Vec<_>>>()
        })
    };
    assert_eq!(run(&shared)?, run(&own)?);
    Ok(())
}

#[test]
fn only_earlier_constants_can_be_shared() -> Result<()> {
    let plain = image()?;
    // The check has not seen half of these.
    let behind = plain.offset(h::W_OPS) - LEN;
    for data in [behind, h::WORDS] {
        let mut changed = plain.clone();
        changed.set(changed.op(LAST) + 3, data as u32);
        changed.seal();
        assert_eq!(changed.check().err(), Some(ImageError::Section), "{data}");
    }
    Ok(())
}
