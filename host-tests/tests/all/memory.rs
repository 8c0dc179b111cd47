//! Scratch memory of whole policies: its size, and its distance from the bound of liveness.

use std::path::Path;

use actq::methods::Activations;
use actq::policy::Policy;
use actq::runtime::ImageBuffer;
use actq_bench::{rtn, shared_policies, ur3};
use actq_cli::report::memory::{Peak, peak};
use actq_kernels::Width;
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
    scratch_is(&ur3(), 1203, [5, 960, 978])
}

#[test]
fn shared_policies_keep_their_scratch_size() -> Result<()> {
    let Some(policies) = shared_policies() else { return Ok(()) };
    for (name, words, values) in [
        ("go1_mlp", 1197, [3, 768, 816]),
        ("g1_lstm64", 508, [0, 256, 256]),
        ("g1_lstm256", 1918, [1, 1120, 1120]),
        ("fetch_pickplace", 733, [3, 512, 540]),
        ("fetch_flow", 2509, [10, 1808, 1836]),
    ] {
        scratch_is(&policies.join(name), words, values)?;
    }
    Ok(())
}
