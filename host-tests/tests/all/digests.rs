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
    images_are(&ur3(), [(362292, 0x8cf8b4fb), (195892, 0x03af1203), (154292, 0xf2e78373), (112692, 0x4e539db9)])
}

#[test]
fn images_of_shared_policies_stay_the_same() -> Result<()> {
    let Some(policies) = shared_policies() else { return Ok(()) };
    images_are(
        &policies.join("go1_mlp"),
        [(210584, 0x49f34427), (111512, 0x776e2a66), (86744, 0x635d1928), (61976, 0x3d00f242)],
    )?;
    images_are(
        &policies.join("g1_lstm256"),
        [(558388, 0xc1afd3d7), (294196, 0xa55bcb33), (228148, 0x0705d8de), (162100, 0xac5bfa68)],
    )?;
    images_are(
        &policies.join("g1_lstm64"),
        [(38976, 0x6e83a1e9), (21376, 0x2ca52304), (16976, 0xde0e76ca), (12576, 0xef073ade)],
    )?;
    images_are(
        &policies.join("fetch_pickplace"),
        [(149952, 0xfbbfe830), (79808, 0x4669b77b), (62272, 0x3e6d4afe), (44736, 0xe8de9c0f)],
    )
}
