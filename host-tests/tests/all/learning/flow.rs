//! The UR3 flow in closed loop: f32, and images of few bits after a short learning.

use actq::budget::Budget;
use actq::data::Recordings;
use actq::methods::{Method, Options, Sampled};
use actq::pipeline::Quantizer;
use actq::policy::Policy;
use actq::runtime::with_head;
use actq_bench::closed_loop::episode_on_host;
use actq_bench::{ur3, ur3_flow};
use actq_ur3::policy_f32::PolicyF32;
use actq_ur3::task::{Outcome, run_episode};
use anyhow::{Context, Result, ensure};

/// Seeds of no recording.
const SEEDS: std::ops::Range<u64> = 1000..1040;
/// Steps of distillation, as in `cargo demo`.
const STEPS: usize = 100;

/// Limits of the tracking error in mm, at most 1.5 times the measured value.
const F32_MM: f64 = 1.3;
const W3_MM: f64 = 2.4;
const W2_MM: f64 = 5.6;

/// Requires success of all episodes but one, and a mean tracking error below a limit in mm.
fn drives(name: &str, outcomes: &[Outcome], limit_mm: f64) -> Result<()> {
    let solved = outcomes.iter().filter(|outcome| outcome.success).count();
    let error = 1e3 * outcomes.iter().map(|outcome| outcome.tracking_error_m).sum::<f64>() / outcomes.len() as f64;
    println!("{name}: {solved} of {}, tracking error {error:.2} mm", outcomes.len());
    ensure!(solved + 1 >= outcomes.len(), "{name}: {solved} of {}", outcomes.len());
    ensure!(error < limit_mm, "{name}: {error:.2} mm, limit {limit_mm} mm");
    Ok(())
}

/// The statistics of every denoising step take a share of the learning time; for other policies they use all frames.
#[test]
fn statistics_keep_their_share_of_the_time() -> Result<()> {
    let policy = Policy::load(&ur3_flow())?;
    let recordings = Recordings::load(&policy)?;
    let all = recordings.calib.as_ref().context("a recording")?.frames();
    let sampled = |minutes| -> Result<Sampled> {
        let quantizer = Quantizer::new(&policy, &recordings, Method::Distill, minutes, |_| {})?;
        quantizer.method().sampled().context("the head is not iterative")
    };
    let (free, bound) = (sampled(None)?, sampled(Some(1e-4))?);
    println!("{free:?}, {bound:?}");
    ensure!(free.frames == all && bound.frames == all);
    ensure!(free.inputs == all.min(8192 / policy.graph.denoising_steps()) && free.outputs == 24 * 128, "{free:?}");
    // 0.6 ms per frame is less than the fewest frames take.
    ensure!(bound.inputs == 64 && bound.outputs == 2 * 128, "{bound:?}");
    let (policy, recordings) = (Policy::load(&ur3())?, Recordings::load(&Policy::load(&ur3())?)?);
    let quantizer = Quantizer::new(&policy, &recordings, Method::Gptq, Some(1e-4), |_| {})?;
    ensure!(quantizer.method().sampled().is_none());
    Ok(())
}

#[test]
fn the_ur3_flow_drives_at_2_bits() -> Result<()> {
    let mut reference = PolicyF32::load(&ur3_flow())?;
    let episode = |seed| {
        reference.reset();
        run_episode(seed, |obs| reference.act(obs))
    };
    drives("f32", &SEEDS.map(episode).collect::<Vec<_>>(), F32_MM)?;
    quantized(2.0, W2_MM)
}

#[test]
#[ignore = "learns for minutes"]
fn the_ur3_flow_drives_at_3_bits() -> Result<()> {
    quantized(3.0, W3_MM)
}

fn quantized(bits: f64, limit_mm: f64) -> Result<()> {
    let policy = Policy::load(&ur3_flow())?;
    let recordings = Recordings::load(&policy)?;
    let quantizer = Quantizer::new(&policy, &recordings, Method::Distill, None, |_| {})?;
    let options = Options { steps: Some(STEPS), ..Options::new(Method::Distill, Budget::BitsPerWeight(bits)) };
    let buffer = quantizer.quantize(&options, ())?.buffer();
    let image = buffer.image("flow".as_ref())?;
    let outcomes = with_head(image, |head| SEEDS.map(|seed| episode_on_host(head, seed)).collect::<Result<Vec<_>>>())?;
    drives(&format!("{bits} bits"), &outcomes, limit_mm)
}
