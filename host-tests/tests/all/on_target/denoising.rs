//! Flow and diffusion policies on the target: the host's bits.

use actq::data::{Dataset, Sizes};
use actq::measure::eval;
use actq::methods::Activations;
use actq::policy::Policy;
use actq::random::Random;
use actq::runtime::ImageBuffer;
use actq_bench::{Target, rtn, shared_policies};
use actq_kernels::Width;
use anyhow::{Result, ensure};

use super::qemu;
use crate::denoising::{drawn, images};

#[test]
fn the_target_gives_the_hosts_bits() -> Result<()> {
    for image in images()? {
        same_bits(image.bytes(), 12)?;
    }
    Ok(())
}

/// Requires the host's bits in QEMU, in this many steps.
fn same_bits(image: &[u8], steps: usize) -> Result<()> {
    let mut random = Random::new(9);
    let obs_len = ImageBuffer::new(image).image("memory".as_ref())?.obs_len();
    let observations: Vec<_> = (0..steps).map(|_| drawn(&mut random, obs_len, 1.0)).collect();
    qemu::same_bits(Target::Fpu, image, &observations)
}

#[test]
fn the_shared_flow_policy_runs_on_the_target() -> Result<()> {
    let Some(dir) = shared_policies().map(|policies| policies.join("fetch_flow")) else { return Ok(()) };
    let policy = Policy::load(&dir)?;
    let heldout = Dataset::load(&dir.join("heldout.npz"), Sizes::of(&policy))?;
    let heldout = heldout.thinned(60, false);
    for (width, limit) in [(Width::W8, 5.1e-4), (Width::W3, 0.33), (Width::W2, 3.0)] {
        let bytes = rtn(&policy, width, 32, Activations::Auto)?;
        let buffer = ImageBuffer::new(&bytes);
        let report = eval::evaluate(buffer.image(&dir)?, &heldout)?;
        println!("fetch_flow, {} bits: NMSE {:.2e}, {} bytes", width.bits(), report.nmse, report.bytes);
        ensure!(report.nmse < limit, "{width:?}: NMSE {}", report.nmse);
        if width != Width::W8 {
            ensure!(bytes.len() < 1 << 20, "{} bytes", bytes.len());
            same_bits(&bytes, 4)?;
        }
    }
    Ok(())
}
