//! The same policy and options give the same image in every release. Rounding to nearest involves no learning, so that
//! its images are the same on every machine, too.

use std::fs;
use std::path::Path;

use actq_bench::command::{actq, run, succeeded};
use actq_bench::{shared_policies, ur3};
use actq_kernels::image::{checksum, header as h};
use anyhow::{Context, Result, ensure};

const WIDTHS: [&str; 4] = ["8", "4", "3", "2"];

/// The bytes of an image without its self-test vector, which is last, and their CRC-32 without the header's.
fn digest(policy_dir: &Path, bits: &str) -> Result<(usize, u32)> {
    // Without recordings, nothing is evaluated.
    let dir = tempfile::tempdir()?;
    for file in ["policy.json", "policy.safetensors"] {
        fs::copy(policy_dir.join(file), dir.path().join(file))?;
    }
    let out = dir.path().join("image.actq");
    let [folder, image] = [dir.path(), &out].map(|path| path.display().to_string());
    succeeded(&run(actq(&["quantize", &folder, "--method", "rtn", "--bits", bits, "--out", &image]), b"")?)?;
    let mut bytes = fs::read(&out)?;
    let self_test = bytes.get(4 * h::W_SELF_TEST..).and_then(|b| b.first_chunk()).context("the image has no header")?;
    bytes.truncate(4 * u32::from_le_bytes(*self_test) as usize);
    bytes.get_mut(..4 * h::WORDS).context("the image has no header")?.fill(0);
    Ok((bytes.len(), checksum(&bytes)))
}

fn images_are(policy_dir: &Path, expected: [(usize, u32); 4]) -> Result<()> {
    let digests = WIDTHS.iter().map(|bits| digest(policy_dir, bits)).collect::<Result<Vec<_>>>()?;
    ensure!(digests == expected, "{}: found {digests:#010x?}, expected {expected:#010x?}", policy_dir.display());
    Ok(())
}

#[test]
fn images_of_ur3_stay_the_same() -> Result<()> {
    images_are(&ur3(), [(362292, 0x4a229d6b), (195892, 0xc5753b93), (154292, 0x343daae3), (112692, 0x8889b429)])
}

#[test]
fn images_of_shared_policies_stay_the_same() -> Result<()> {
    let Some(policies) = shared_policies() else { return Ok(()) };
    images_are(
        &policies.join("go1_mlp"),
        [(210584, 0x532569f7), (111512, 0x6db807b6), (86744, 0x798b34f8), (61976, 0x27d6df92)],
    )?;
    images_are(
        &policies.join("g1_lstm256"),
        [(558388, 0xa8aad05d), (294196, 0xcc5ec8b9), (228148, 0x6e00db54), (162100, 0xc55ef9e2)],
    )?;
    images_are(
        &policies.join("g1_lstm64"),
        [(38976, 0x6e83a1e9), (21376, 0x2ca52304), (16976, 0xde0e76ca), (12576, 0xef073ade)],
    )?;
    images_are(
        &policies.join("fetch_pickplace"),
        [(149952, 0x48b3b745), (79808, 0xf565e80e), (62272, 0x8d61158b), (44736, 0x5bd2c37a)],
    )
}
