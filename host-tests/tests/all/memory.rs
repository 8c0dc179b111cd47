//! Scratch memory of whole policies: its size, its distance from the bound of liveness, and its way back from a head.

use std::path::Path;

use actq::methods::Activations;
use actq::policy::Policy;
use actq::runtime::ImageBuffer;
use actq_bench::{rtn, shared_policies, ur3};
use actq_cli::report::memory::{Peak, peak};
use actq_kernels::{Head, Width};
use anyhow::{Result, ensure};

/// Words of the arena, and of the values that operations write: the place of the largest need, the words needed there,
/// and the words provided.
fn scratch_is(dir: &Path, words: usize, [op, needed, placed]: [usize; 3]) -> Result<()> {
    let buffer = ImageBuffer::new(&rtn(&Policy::load(dir)?, Width::W3, 0, Activations::Auto)?);
    let image = buffer.image(dir)?;
    let (is, expected) = ((image.scratch_words(), peak(&image)), (words, Peak { op, words: needed, placed }));
    ensure!(is == expected, "{}: found {is:?}, expected {expected:?}", dir.display());
    Ok(())
}

#[test]
fn the_ur3_policy_keeps_its_scratch_size() -> Result<()> {
    scratch_is(&ur3(), 1030, [5, 960, 978])
}

#[test]
fn shared_policies_keep_their_scratch_size() -> Result<()> {
    let Some(policies) = shared_policies() else { return Ok(()) };
    for (name, words, values) in [
        ("go1_mlp", 669, [3, 577, 609]),
        ("g1_lstm64", 498, [0, 256, 256]),
        ("g1_lstm256", 1883, [1, 1085, 1085]),
        ("fetch_pickplace", 609, [3, 512, 540]),
        ("fetch_flow", 1905, [10, 1808, 1836]),
    ] {
        scratch_is(&policies.join(name), words, values)?;
    }
    Ok(())
}

#[test]
fn a_head_gives_its_memory_to_the_next_one() -> Result<()> {
    let policy = Policy::load(&ur3())?;
    let images =
        [Width::W3, Width::W8].map(|width| rtn(&policy, width, 0, Activations::Auto).map(|i| ImageBuffer::new(&i)));
    let mut scratch: Vec<u32> = vec![7; 2000];
    let mut memory: &mut [u32] = &mut scratch;
    for buffer in images {
        let buffer = buffer?;
        let image = buffer.image(&ur3())?;
        let observation = vec![0.5; image.obs_len()];
        let mut fresh = vec![0; image.scratch_words()];
        let expected = Head::new(image, &mut fresh)?.infer(&observation)?.to_vec();
        let mut head = Head::new(image, memory)?;
        ensure!(head.infer(&observation)? == expected);
        memory = head.into_scratch();
        ensure!(memory.len() == 2000 && memory[1990..] == [7; 10]);
    }
    Ok(())
}
