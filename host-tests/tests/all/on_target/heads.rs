//! Heads of published sizes (`examples/heads`) on the target: the host's bits, and the predicted cost.

use actq::measure::time::{CLOCK, StepTime};
use actq::methods::Activations;
use actq::random::Random;
use actq::runtime::{ImageBuffer, with_head};
use actq_bench::profile::Harness;
use actq_bench::{Target, bits, rtn};
use actq_heads::{octo, oft};
use actq_kernels::Width;
use actq_kernels::cost::Core;
use anyhow::{Result, bail, ensure};

const TOKEN: usize = 384;
/// Largest relative error of a prediction.
const ERROR: f64 = 0.03;

fn near(what: &str, predicted: u64, counted: u64) -> Result<()> {
    let error = predicted as f64 / counted as f64 - 1.0;
    println!("{what}: {predicted} predicted, {counted} counted: {:+.2}%", 1e2 * error);
    ensure!(error.abs() < ERROR, "{what}: {predicted} for {counted}");
    Ok(())
}

/// A chunk of Octo's head in 20 denoising steps and in 10: the common part runs once, the rest in each step.
#[test]
fn octos_head_matches_the_prediction_and_the_host() -> Result<()> {
    let harness = Harness::build(Target::Fpu)?;
    let mut random = Random::new(3);
    let observation: Vec<f32> = (0..TOKEN).map(|_| random.normal()).collect();
    let mut chunks = Vec::new();
    for steps in [octo::STEPS, octo::STEPS / 2] {
        let policy = octo::head(TOKEN, steps)?.policy()?;
        let bytes = rtn(&policy, Width::W3, 32, Activations::Auto)?;
        ensure!(bytes.len() < 750_000, "{} bytes", bytes.len());
        let buffer = ImageBuffer::new(&bytes);
        let image = buffer.image("octo".as_ref())?;
        let (costs, actions) = harness.regions(&bytes, "serve", std::slice::from_ref(&observation))?;
        let expected = with_head::<_, anyhow::Error>(image, |head| Ok(bits(head.step(&observation)?)))?;
        ensure!(bits(&actions[0]) == expected, "the bits differ in {steps} steps");
        let time = StepTime::new(&image, Core::M4f, CLOCK);
        near(&format!("a chunk in {steps} steps"), time.instructions, costs[0].instructions)?;
        chunks.push([time.instructions, costs[0].instructions]);
    }
    let [whole, half] = chunks[..] else { bail!("{chunks:?}") };
    // Noise is drawn before the first step, in an amount that grows with the number of steps.
    let step = [0, 1].map(|i| (whole[i] - half[i]) / (octo::STEPS / 2) as u64);
    let once = [0, 1].map(|i| 2 * half[i] - whole[i]);
    near("a denoising step and its noise", step[0], step[1])?;
    near("the part that runs once", once[0], once[1])
}

/// All rows of a chunk share the matrices, which are in the image once; norms and biases are repeated for each row.
#[test]
fn ofts_head_stores_its_matrices_once() -> Result<()> {
    const HIDDEN: usize = 64;
    let policy = oft::head(HIDDEN)?.policy()?;
    ensure!(policy.weights == oft::weights(HIDDEN), "{} weights", policy.weights);
    let bytes = rtn(&policy, Width::W8, 0, Activations::Auto)?;
    let buffer = ImageBuffer::new(&bytes);
    let image = buffer.image("oft".as_ref())?;
    let time = StepTime::new(&image, Core::M4f, CLOCK);
    ensure!(time.macs == 8 * policy.weights, "{} MACs", time.macs);
    let self_test = 4 * image.self_test_steps() * (image.obs_len() + image.act_len());
    ensure!(self_test <= 64 << 10, "{self_test} bytes of self-test");
    ensure!(bytes.len() - self_test < 3 * policy.weights, "{} bytes", bytes.len());
    with_head::<_, anyhow::Error>(image, |head| Ok(head.self_test()?))
}
