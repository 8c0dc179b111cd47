//! Batches against heads of `actq-kernels`, bit for bit, on every level of vector instructions that the machine has.

mod images;
mod inputs;

use actq::random::Random;
use actq::runtime::ImageBuffer;
use actq_bench::bits;
use actq_kernels::{Head, Image};
use anyhow::{Result, ensure};
use fearless_simd::Level;
use proptest::prelude::*;

use crate::Batch;

/// Steps of a run.
const STEPS: usize = 8;

/// Returns the levels of vector instructions that the machine has.
fn levels() -> Vec<Level> {
    let best = Level::new();
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    let levels = [
        best.as_sse2().map(Level::Sse2),
        best.as_sse4_2().map(Level::Sse4_2),
        best.as_avx2().map(Level::Avx2),
        best.as_avx512().map(Level::Avx512),
    ];
    #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
    let levels = [Some(best)];
    levels.into_iter().flatten().collect()
}

/// Runs `work` with the image of these bytes and `count` heads of it.
fn with_heads<T>(
    bytes: &[u8],
    count: usize,
    work: impl FnOnce(&Image<'_>, &mut [Head<'_, '_>]) -> Result<T>,
) -> Result<T> {
    let buffer = ImageBuffer::new(bytes);
    let image = buffer.image("test".as_ref())?;
    let mut scratch = vec![0; count * image.scratch_words()];
    let scratch = scratch.chunks_exact_mut(image.scratch_words());
    let mut heads = scratch.map(|scratch| Ok(Head::new(image, scratch)?)).collect::<Result<Vec<_>>>()?;
    work(&image, &mut heads)
}

/// Requires that batches on every level give the bits of single heads, over steps with random resets and seeds.
fn same_bits(bytes: &[u8], count: usize, seed: u64) -> Result<()> {
    with_heads(bytes, count, |image, heads| {
        let batch = |level| Ok((level, Batch::at_level(level, bytes, count)?));
        let mut batches = levels().into_iter().map(batch).collect::<Result<Vec<_>>>()?;
        let mut random = Random::new(seed);
        let seeds: Vec<u32> = (0..count).map(|_| random.below(1000) as u32).collect();
        for (head, seed) in heads.iter_mut().zip(&seeds) {
            head.seed(*seed);
        }
        for (_, batch) in &mut batches {
            batch.seed(&seeds)?;
        }
        for step in 0..STEPS {
            let observations: Vec<f32> = (0..count * image.obs_len()).map(|_| random.normal()).collect();
            let reset: Vec<bool> = (0..count).map(|_| random.below(4) == 0).collect();
            let reset = (step % 3 > 0).then_some(&reset[..]);
            let mut expected = Vec::new();
            for (i, (head, observation)) in heads.iter_mut().zip(observations.chunks_exact(image.obs_len())).enumerate()
            {
                if reset.is_some_and(|reset| reset[i]) {
                    head.reset();
                }
                expected.extend(bits(head.step(observation)?));
            }
            for (level, batch) in &mut batches {
                let mut actions = vec![f32::NAN; count * image.act_len()];
                batch.step(&observations, reset, &mut actions)?;
                ensure!(bits(&actions) == expected, "{level:?}: the bits of step {step} differ");
            }
        }
        Ok(())
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn all_operations_have_the_bits_of_heads(seed in any::<u64>(), count in 1usize..=130) {
        let outcome = images::network(seed).and_then(|bytes| same_bits(&bytes, count, seed));
        prop_assert!(outcome.is_ok(), "{outcome:?}");
    }

    #[test]
    fn products_have_the_bits_of_heads(seed in any::<u64>(), count in 1usize..=130) {
        let outcome = images::products(seed).and_then(|bytes| same_bits(&bytes, count, seed));
        prop_assert!(outcome.is_ok(), "{outcome:?}");
    }

    #[test]
    fn denoising_steps_have_the_bits_of_heads(seed in any::<u64>(), count in 1usize..=70) {
        let outcome = images::denoiser(seed).and_then(|bytes| same_bits(&bytes, count, seed));
        prop_assert!(outcome.is_ok(), "{outcome:?}");
    }

    #[test]
    fn around_operations_have_the_bits_of_heads(seed in any::<u64>(), count in 1usize..=70) {
        let outcome = images::around(seed).and_then(|bytes| same_bits(&bytes, count, seed));
        prop_assert!(outcome.is_ok(), "{outcome:?}");
    }
}

#[test]
fn products_that_accumulate_have_the_bits_of_heads() -> Result<()> {
    same_bits(&images::accumulating()?, 67, 1)
}

#[test]
fn thread_counts_do_not_change_the_bits() -> Result<()> {
    let bytes = images::network(3)?;
    for threads in [1, 3, 8] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
        pool.install(|| same_bits(&bytes, 101, 3))?;
    }
    Ok(())
}
