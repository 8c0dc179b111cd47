//! Budgets of bits and bytes on random networks: images keep and use them, and a refusal names the least budget.

use actq::budget::{Budget, BudgetTooSmall};
use actq::data::{Dataset, Recordings};
use actq::graph::ops::{LayerNorm, Linear, Pointwise};
use actq::graph::{Graph, WeightMatrix};
use actq::measure::size::bits_per_weight;
use actq::methods::{Method, Options, Outcome};
use actq::pipeline::{QuantizedPolicy, Quantizer, Reason, Unused, check_budget};
use actq::policy::Policy;
use actq::random::Random;
use actq_kernels::Width;
use actq_kernels::math::Function;
use actq_research::actquant::ActQuant;
use actq_research::actquant::choices::Choices;
use anyhow::{Context as _, Result, ensure};
use ndarray::Array3;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

const FRAMES: usize = 200;

/// A network to draw.
#[derive(Clone, Debug)]
struct Shape {
    sizes: Vec<usize>,
    biases: bool,
    norm: bool,
    seed: u64,
}

/// A multilayer perceptron of the shape, without or with biases and a norm after its first layer.
fn policy(shape: &Shape) -> Result<Policy> {
    let mut random = Random::new(shape.seed);
    let mut graph = Graph::new(shape.sizes[0]);
    let mut value = 0;
    for (layer, pair) in shape.sizes.windows(2).enumerate() {
        let (cols, rows) = (pair[0], pair[1]);
        let data = (0..rows * cols).map(|_| random.normal() / (cols as f32).sqrt()).collect();
        let matrix = graph.add_matrix(WeightMatrix { name: format!("w{layer}"), rows, cols, data })?;
        let bias = (0..rows).map(|_| if shape.biases { 0.1 * random.normal() } else { 0.0 }).collect();
        value = graph.add(Linear { matrix, bias }, &[value])?;
        // The norm of a few values is no sound statistic.
        if shape.norm && layer == 0 && rows > 4 {
            value = graph.add(LayerNorm { weight: vec![1.0; rows], bias: vec![0.0; rows], eps: 1e-5 }, &[value])?;
        }
        if layer + 2 < shape.sizes.len() {
            value = graph.add(Pointwise(Function::Tanh), &[value])?;
        }
    }
    Ok(Policy::of("drawn", graph))
}

fn recordings(policy: &Policy) -> Recordings {
    let mut random = Random::new(3);
    let obs = Array3::from_shape_fn((1, FRAMES, policy.graph.obs_len), |_| random.normal());
    let calib = Dataset { path: "drawn".into(), obs, action: None, length: vec![FRAMES], state: None };
    Recordings { calib: Some(calib), heldout: None }
}

fn options(method: Method, budget: Budget) -> Options {
    Options { steps: Some(0), ..Options::new(method, budget) }
}

fn quantize(quantizer: &Quantizer<'_>, budget: Budget) -> actq::error::Result<QuantizedPolicy> {
    quantizer.quantize(&options(quantizer.method().method().clone(), budget), ())
}

fn too_small(result: actq::error::Result<impl Sized>) -> Result<BudgetTooSmall> {
    let error = result.err().context("expected a refusal")?;
    error.budget().copied().ok_or(error.into())
}

/// The fewest bytes of a row with more bits: of `outcome`'s rows, in their sorted order, if sorted.
fn next_row(outcome: &Outcome, sorted: bool) -> Option<usize> {
    let widths = &outcome.quantized.widths;
    let widened = |row: usize, width: Width| {
        let mut wider = outcome.clone();
        wider.quantized.widths[row] = Some(width);
        if sorted {
            wider.quantized.widths.sort();
        }
        wider.bytes().saturating_sub(outcome.bytes())
    };
    let of_row = |row: usize| Width::ALL.into_iter().filter(move |w| widths[row] < Some(*w)).map(move |w| (row, w));
    (0..widths.len()).flat_map(of_row).map(|(row, width)| widened(row, width)).min()
}

/// Requires that at least 97% is used, or that no remaining step fits.
fn check_used(found: &QuantizedPolicy, options: &Options, left: usize) -> Result<()> {
    let Some(Unused { used, allowed, reason }) = Unused::of(found, options) else { return Ok(()) };
    let last = found.outcomes.len() - 1;
    let next = found.outcomes.iter().enumerate().filter_map(|(m, outcome)| next_row(outcome, m < last)).min();
    let fits = next.is_some_and(|next| next <= left);
    ensure!(reason != Reason::Step || !fits, "used {used} of {allowed} bytes, {left} left; a row takes {next:?}");
    Ok(())
}

fn shapes() -> impl Strategy<Value = Shape> {
    let sizes = (1..24usize, prop::collection::vec(prop_oneof![3 => 1..40usize, 1 => 100..160usize], 0..4), 1..9usize);
    (sizes, any::<bool>(), any::<bool>(), any::<u64>()).prop_map(|((obs, hidden, act), biases, norm, seed)| Shape {
        sizes: [vec![obs], hidden, vec![act]].concat(),
        biases,
        norm,
        seed,
    })
}

fn fixed(cases: u32) -> ProptestConfig {
    ProptestConfig { rng_seed: RngSeed::Fixed(27), failure_persistence: None, ..ProptestConfig::with_cases(cases) }
}

proptest! {
    #![proptest_config(fixed(24))]

    #[test]
    fn bytes_are_kept_and_used(shape in shapes(), share in 0.0..1.0f64) {
        let within = || -> Result<()> {
            let policy = policy(&shape)?;
            let recordings = recordings(&policy);
            let quantizer = Quantizer::new(&policy, &recordings, Method::Distill, None, |_| {})?;
            let least = too_small(quantize(&quantizer, Budget::ImageBytes(0)))?.bytes;
            let most = quantize(&quantizer, Budget::Width(Width::W8))?.image.len();
            for bytes in [least, least + (share * (most - least) as f64) as usize] {
                let found = quantize(&quantizer, Budget::ImageBytes(bytes))?;
                let len = found.image.len();
                ensure!(len <= bytes, "{len} bytes for a budget of {bytes}");
                check_used(&found, &options(Method::Distill, Budget::ImageBytes(bytes)), bytes - len)?;
            }
            ensure!(too_small(quantize(&quantizer, Budget::ImageBytes(least - 1)))?.bytes == least, "the refusal names another least budget");
            Ok(())
        };
        within().map_err(|error| TestCaseError::fail(format!("{error:#}")))?;
    }

    #[test]
    fn bits_are_kept_and_used(shape in shapes(), bits in 0.3..9.0f64) {
        let within = || -> Result<()> {
            let policy = policy(&shape)?;
            let recordings = recordings(&policy);
            let quantizer = Quantizer::new(&policy, &recordings, Method::Distill, None, |_| {})?;
            let found = match quantize(&quantizer, Budget::BitsPerWeight(bits)) {
                Ok(found) => found,
                Err(error) => return too_small(Err::<(), _>(error)).map(drop),
            };
            let used = bits_per_weight(&found.buffer().image("drawn".as_ref())?);
            ensure!(used <= bits, "{used} bits for a budget of {bits}");
            let left = (bits - used) * policy.weights as f64 / 8.0;
            check_used(&found, &options(Method::Distill, Budget::BitsPerWeight(bits)), left as usize)
        };
        within().map_err(|error| TestCaseError::fail(format!("{error:#}")))?;
    }
}

#[test]
fn every_method_names_the_smallest_image() -> Result<()> {
    let policy = policy(&Shape { sizes: vec![9, 40, 30, 3], biases: true, norm: true, seed: 5 })?;
    let mut recordings = recordings(&policy);
    if let Some(calib) = &mut recordings.calib {
        calib.fill_actions(&policy.graph);
    }
    for method in [Method::Rtn, Method::Gptq, Method::custom(ActQuant(Choices::default())), Method::Distill] {
        let quantizer = Quantizer::new(&policy, &recordings, method.clone(), None, |_| {})?;
        let check = |bytes: usize| check_budget(&policy, &options(method.clone(), Budget::ImageBytes(bytes)));
        let least = too_small(check(0)).context(method.to_string())?.bytes;
        ensure!(check(least - 1).is_err() && check(least).is_ok(), "{method}: {least} bytes are not the least");
        let len = quantize(&quantizer, Budget::ImageBytes(least)).context(method.to_string())?.image.len();
        ensure!(len <= least && len + 4 > least, "{method}: {len} bytes for a budget of {least}");
    }
    Ok(())
}

#[test]
fn a_learning_image_keeps_its_bytes() -> Result<()> {
    let policy = policy(&Shape { sizes: vec![9, 40, 30, 3], biases: false, norm: true, seed: 5 })?;
    let recordings = recordings(&policy);
    let quantizer = Quantizer::new(&policy, &recordings, Method::Distill, None, |_| {})?;
    for bytes in [1200, 1600, 2200] {
        let options = Options { steps: Some(5), ..options(Method::Distill, Budget::ImageBytes(bytes)) };
        let len = quantizer.quantize(&options, ())?.image.len();
        ensure!(len <= bytes && len as f64 >= 0.97 * bytes as f64, "{len} bytes for a budget of {bytes}");
    }
    Ok(())
}

#[test]
fn an_unused_remainder_has_a_reason() -> Result<()> {
    let shape = Shape { sizes: vec![9, 40, 3], biases: true, norm: false, seed: 5 };
    let mut policy = policy(&shape)?;
    let reason = |policy: &Policy, bits: f64| -> Result<Option<Reason>> {
        let recordings = recordings(policy);
        let quantizer = Quantizer::new(policy, &recordings, Method::Distill, None, |_| {})?;
        let budget = Budget::BitsPerWeight(bits);
        Ok(Unused::of(&quantize(&quantizer, budget)?, &options(Method::Distill, budget)).map(|unused| unused.reason))
    };
    assert_eq!(reason(&policy, 20.0)?, Some(Reason::Widest));
    // Nothing reads the second half of the hidden values.
    policy.graph.matrices[1].data.chunks_mut(40).for_each(|row| row[20..].fill(0.0));
    assert_eq!(reason(&policy, 20.0)?, Some(Reason::NoError));
    Ok(())
}
