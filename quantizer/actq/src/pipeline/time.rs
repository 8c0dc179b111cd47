//! Finds the most bits whose step keeps a time limit.

use std::path::Path;

use super::quantizer::{QuantizedPolicy, Quantizer};
use crate::budget::{Rate, TimeLimit};
use crate::emit;
use crate::error::{Context, Error, Result, ensure};
use crate::measure::time::StepTime;
use crate::methods::{Activations, Options, Progress};

/// Bits per weight above those of any image.
const MOST_BITS: f64 = 10.0;
/// Tries between the least and the most bits; the last two differ by a hundredth of a bit.
const TRIES: usize = 10;

/// Predicts the step of an image.
fn predict(quantized: &QuantizedPolicy, limit: TimeLimit) -> Result<StepTime> {
    Ok(StepTime::new(&quantized.buffer().image(Path::new("the new image"))?, limit.clock_hz))
}

/// Makes the image of the most bits per weight whose step keeps the limit; `options.budget` is ignored.
///
/// The bits are found with the activations before measurement and without learning, which does not affect time; then
/// the policy is quantized one time. Activations that the method prefers in int16 get it as far as the time allows.
/// `progress` receives the share done.
pub(super) fn most_bits(
    quantizer: &Quantizer<'_>,
    options: &Options,
    limit: TimeLimit,
    progress: &mut dyn FnMut(Progress),
) -> Result<QuantizedPolicy> {
    let allowed = limit.milliseconds;
    let activations = match options.activations {
        Activations::Auto => Activations::Unmeasured,
        given => given,
    };
    let draft = Options { activations, steps: Some(1), ..options.clone() };
    let with = |bits: f64| quantizer.at(Rate::BitsPerWeight(bits), &draft, &mut |_| {});
    let time = |bits: f64| Ok::<_, Error>(predict(&with(bits)?, limit)?.milliseconds);
    let (mut low, mut high) = (least_bits(with(f64::MIN_POSITIVE))?, MOST_BITS);
    let fastest = time(low)?;
    ensure!(
        fastest <= allowed,
        "{allowed} ms are allowed, but the fastest step takes {fastest:.3} ms at {} MHz, with {low:.3} bits per weight",
        limit.clock_hz / 1e6
    );
    if time(high)? <= allowed {
        low = high;
    }
    for _ in 0..TRIES {
        let middle = 0.5 * (low + high);
        if time(middle)? <= allowed {
            low = middle;
        } else {
            high = middle;
        }
    }
    let mut quantized = quantizer.at(Rate::BitsPerWeight(low), options, progress)?;
    // Return matrices to int8, the largest first.
    let outcomes = &quantized.outcomes;
    let mut wide: Vec<usize> = (0..outcomes.len()).filter(|&m| outcomes[m].x_max > activations.limit()).collect();
    wide.sort_by_key(|&m| outcomes[m].quantized.codes.len());
    loop {
        let time = predict(&quantized, limit)?;
        if time.milliseconds <= allowed {
            return Ok(QuantizedPolicy { time: Some(time), ..quantized });
        }
        let m = wide.pop().context("the step takes longer than was predicted before learning")?;
        let outcome = &mut quantized.outcomes[m];
        outcome.x_max = outcome.quantized.x_max(activations.limit())?;
        quantized.image = emit::image(&quantized.policy, &quantized.outcomes)?;
    }
}

/// Returns the fewest bits per weight of a method, from its refusal of a budget near zero.
fn least_bits<T>(refused: Result<T>) -> Result<f64> {
    match refused {
        Ok(_) => Ok(f64::MIN_POSITIVE),
        Err(error) => match error.budget() {
            // Add a little for the division's rounding.
            Some(least) => Ok((1.0 + 1e-9) * 8.0 * least.bytes as f64 / least.weights.max(1) as f64),
            None => Err(error),
        },
    }
}
