//! The method distill on whole policies: determinism, and limits of the error.

use std::path::Path;
use std::sync::LazyLock;

use actq::budget::Budget;
use actq::data::Recordings;
use actq::measure::eval::{self, ErrorReport};
use actq::methods::{Effort, Method, Options};
use actq::pipeline::Quantizer;
use actq::policy::Policy;
use actq::runtime::ImageBuffer;
use actq_bench::{shared_policies, ur3};
use actq_kernels::Width;
use anyhow::Result;

use super::recorded::TOLERANCE;
use super::units::{self, SMALL_OBS, small};

fn image(quantizer: &Quantizer<'_>, options: &Options) -> actq::error::Result<Vec<u8>> {
    Ok(quantizer.quantize(options, ())?.image)
}

fn report(dir: &Path, bytes: &[u8]) -> Result<ErrorReport> {
    let buffer = ImageBuffer::new(bytes);
    let image = buffer.image(dir)?;
    Ok(eval::evaluate(image, &eval::heldout(dir, &image)?)?)
}

/// The UR3 policy with its recordings.
static UR3: LazyLock<(Policy, Recordings)> = LazyLock::new(|| {
    let policy = Policy::load(&ur3()).expect("the policy loads");
    let recordings = Recordings::load(&policy).expect("the recordings load");
    (policy, recordings)
});

fn quantizer() -> Result<Quantizer<'static>> {
    Ok(Quantizer::new(&UR3.0, &UR3.1, Method::Distill, None, |_| {})?)
}

fn distill(bits: f64, steps: usize) -> Options {
    Options { steps: Some(steps), ..Options::new(Method::Distill, Budget::BitsPerWeight(bits)) }
}

#[test]
fn the_image_is_independent_of_the_thread_count() -> Result<()> {
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
        pool.install(|| {
            let policy = Policy::load(&ur3())?;
            image(
                &Quantizer::new(&policy, &Recordings::load(&policy)?, Method::Distill, None, |_| {})?,
                &distill(2.0, 20),
            )
        })
    };
    assert!(on(1)? == on(3)?);
    Ok(())
}

#[test]
fn a_forced_width_reaches_every_row() -> Result<()> {
    let quantizer = quantizer()?;
    let forced = |name: &str| Options { forced: vec![(name.into(), Width::W4)], ..distill(2.0, 2) };
    let outcomes = quantizer.quantize(&forced("out.weight"), ())?.outcomes;
    let out = UR3.0.graph.matrices.iter().position(|m| m.name == "out.weight");
    assert!(out.is_some_and(|m| outcomes[m].quantized.widths.iter().all(|w| *w == Some(Width::W4))));
    assert!(quantizer.quantize(&forced("no.such"), ()).is_err());
    Ok(())
}

#[test]
fn another_seed_gives_another_image() -> Result<()> {
    let units = [1.0; SMALL_OBS];
    let policy = Policy::of("small", small(&units, 3)?);
    let recordings = Recordings { calib: Some(units::recorded(1, &units, &policy.graph)), heldout: None };
    let quantizer = Quantizer::new(&policy, &recordings, Method::Distill, None, |_| {})?;
    // As many steps as learning needs to be kept.
    let options = distill(2.0, 200);
    let other = Options { seed: 2, ..options.clone() };
    assert!(image(&quantizer, &options)? != image(&quantizer, &other)?, "the seed changes nothing");
    Ok(())
}

/// Errors below half of GPTQ's at about the same bits (GPTQ has one scale per row and one width, so it gets slightly
/// more), with the effort quick: all of its steps, or fewer.
fn halves_gptq(dir: &Path, steps: Option<usize>, bits: f64, width: Width) -> Result<()> {
    let policy = Policy::load(dir)?;
    let recordings = Recordings::load(&policy)?;
    let quantizer = Quantizer::new(&policy, &recordings, Method::Distill, None, |_| {})?;
    let gptq = Quantizer::new(&policy, &recordings, Method::Gptq, None, |_| {})?;
    let options =
        Options { steps, effort: Effort::Quick, ..Options::new(Method::Distill, Budget::BitsPerWeight(bits)) };
    let ours = report(dir, &image(&quantizer, &options)?)?;
    let theirs = report(dir, &image(&gptq, &Options::new(Method::Gptq, Budget::Width(width)))?)?;
    assert!(ours.bpw < theirs.bpw);
    assert!(ours.nmse < 0.5 * theirs.nmse, "{}: {} against {}", policy.name, ours.nmse, theirs.nmse);
    Ok(())
}

#[test]
fn the_ur3_head_halves_gptqs_error() -> Result<()> {
    halves_gptq(&ur3(), Some(500), 2.0, Width::W2)
}

#[test]
#[ignore = "learns for minutes"]
fn the_ur3_head_halves_gptqs_error_at_3_bits() -> Result<()> {
    halves_gptq(&ur3(), None, 3.0, Width::W3)
}

#[test]
fn a_recurrent_policy_halves_gptqs_error() -> Result<()> {
    let Some(policies) = shared_policies() else { return Ok(()) };
    halves_gptq(&policies.join("g1_lstm256"), Some(100), 2.0, Width::W2)
}

/// The errors of a shared policy, at bits per weight and after learning steps, stay below limits.
fn stays_below(name: &str, limits: &[(f64, Option<usize>, f64)]) -> Result<()> {
    let Some(policies) = shared_policies() else { return Ok(()) };
    let dir = policies.join(name);
    let policy = Policy::load(&dir)?;
    let recordings = Recordings::load(&policy)?;
    let quantizer = Quantizer::new(&policy, &recordings, Method::Distill, None, |_| {})?;
    for &(bits, steps, limit) in limits {
        let options = Options { steps, ..Options::new(Method::Distill, Budget::BitsPerWeight(bits)) };
        let found = report(&dir, &image(&quantizer, &options)?)?;
        assert!(found.nmse < limit, "{name} at {bits} bits: {}, limit {limit}", found.nmse);
        assert!(found.bpw <= bits);
    }
    Ok(())
}

/// The method balances its columns: unbalanced, its error was 3.8e-2.
#[test]
fn a_recurrent_policy_without_normalization_keeps_its_error() -> Result<()> {
    stays_below("g1_lstm64", &[(2.0, Some(1500), 0.027)])
}

/// The limit of an error at bits per weight after learning steps, from its recorded value.
fn recorded(bits: f64, steps: Option<usize>, nmse: f64) -> (f64, Option<usize>, f64) {
    (bits, steps, TOLERANCE * nmse)
}

const FIRST: Option<usize> = Some(1000);

#[test]
fn shared_policies_keep_their_errors() -> Result<()> {
    stays_below("go1_mlp", &[recorded(2.0, FIRST, 8.9e-3)])?;
    stays_below("fetch_pickplace", &[recorded(2.0, FIRST, 3.5e-2)])
}

/// All learning steps, as the command's default, and more bits.
#[test]
#[ignore = "learns for minutes"]
fn shared_policies_keep_their_errors_to_the_end() -> Result<()> {
    stays_below("go1_mlp", &[recorded(2.5, None, 5.2e-3), recorded(3.0, FIRST, 4.1e-3)])?;
    stays_below("fetch_pickplace", &[recorded(3.0, FIRST, 2.3e-2)])
}
