//! Images whose step keeps a time limit.

use std::path::Path;

use super::flash;
use super::quantizer::{QuantizedPolicy, Quantizer};
use crate::budget::{Rate, TimeLimit};
use crate::emit;
use crate::error::{Context, Result, ensure};
use crate::measure::time::StepTime;
use crate::methods::{Activations, Method, Options, Progress};
use crate::runtime::ImageBuffer;

/// Bits per weight above those of any image.
const MAX_BITS: f64 = 10.0;
/// Tries between the least and the most bits; the last two differ by a hundredth of a bit.
const TRIES: usize = 10;
/// Tries to find the cycles of everything but the rows, and the share of the limit by which they may vary.
const REST_TRIES: usize = 2;
const REST_MARGIN: f64 = 0.001;

/// Predicts the step of an image in the layouts of the limit's core.
fn predict(quantized: &QuantizedPolicy, limit: TimeLimit) -> Result<StepTime> {
    let packed = ImageBuffer::new(&emit::repack(&quantized.image, limit.core)?);
    Ok(StepTime::new(&packed.image(Path::new("the new image"))?, limit.core, limit.clock_hz))
}

/// Makes the image with the lowest expected error whose step keeps the limit; `options.budget` is ignored. Of methods
/// that do not allocate by time, it is the image of the most bits per weight.
///
/// The rate is found with the activations before measurement and without learning, which does not affect time; then
/// the policy is quantized once. Activations that the method prefers in int16 get it as far as the time allows.
/// `progress` receives the share done.
pub(super) fn within(
    quantizer: &Quantizer<'_>,
    options: &Options,
    limit: TimeLimit,
    progress: &mut dyn FnMut(Progress),
) -> Result<QuantizedPolicy> {
    let activations = match options.activations {
        Activations::Auto => Activations::Unmeasured,
        given => given,
    };
    let draft = Options { activations, steps: Some(1), ..options.clone() };
    let draft = Draft { quantizer, options: &draft, limit };
    let rate = match options.method {
        Method::Distill => draft.cycles()?,
        _ => draft.most_bits()?,
    };
    let quantized = quantizer.at(rate, options, progress)?;
    kept(quantized, limit, activations)
}

/// Images without learning, to find a rate.
struct Draft<'a, 'q> {
    quantizer: &'a Quantizer<'q>,
    options: &'a Options,
    limit: TimeLimit,
}

impl Draft<'_, '_> {
    fn at(&self, rate: Rate) -> Result<QuantizedPolicy> {
        self.quantizer.at(rate, self.options, &mut |_| {})
    }

    /// Finds the cycles that rows may take: the limit less the cycles of everything else, which hardly depend on the
    /// rows.
    fn cycles(&self) -> Result<Rate> {
        let TimeLimit { milliseconds, core, clock_hz, image_bytes } = self.limit;
        // More than any step takes, and small enough for sums.
        let allowed = (milliseconds * clock_hz / 1e3).min(1e18);
        let bytes = image_bytes.map(|bytes| flash::room(self.quantizer, self.options, bytes)).transpose()?;
        let Quantizer { method, .. } = self.quantizer;
        // The cycles of a whole step, and those of everything but the rows.
        let taken = |rate: Rate| -> Result<(f64, f64)> {
            let network = method.quantize(rate, self.options, |_| {})?;
            let counted = network.cycles.unwrap_or_default();
            let cycles = predict(&self.quantizer.image_of(network, rate)?, self.limit)?.cycles as f64;
            Ok((cycles, cycles - counted))
        };
        let (fastest, mut rest) = taken(Rate::Within { bytes, cycles: 0.0, core })?;
        self.check(1e3 * fastest / clock_hz)?;
        // A network of one row in every matrix lacks some operations.
        for _ in 0..REST_TRIES {
            rest = taken(Rate::Within { bytes, cycles: (allowed - rest).max(0.0), core })?.1.max(rest);
        }
        Ok(Rate::Within { bytes, cycles: (allowed - rest - REST_MARGIN * allowed).max(0.0), core })
    }

    /// Finds the most bits per weight.
    fn most_bits(&self) -> Result<Rate> {
        let keeps = |quantized: &QuantizedPolicy| -> Result<bool> {
            let small = self.limit.image_bytes.is_none_or(|bytes| quantized.image.len() <= bytes);
            Ok(small && predict(quantized, self.limit)?.milliseconds <= self.limit.milliseconds)
        };
        let (mut low, mut high) = (least_bits(self.at(Rate::BitsPerWeight(f64::MIN_POSITIVE)))?, MAX_BITS);
        let fastest = self.at(Rate::BitsPerWeight(low))?;
        self.check(predict(&fastest, self.limit)?.milliseconds)?;
        if let Some(bytes) = self.limit.image_bytes {
            let least = fastest.image.len();
            ensure!(least <= bytes, "the smallest image takes {least} bytes, but {bytes} are allowed");
        }
        if keeps(&self.at(Rate::BitsPerWeight(high))?)? {
            low = high;
        }
        for _ in 0..TRIES {
            let middle = 0.5 * (low + high);
            if keeps(&self.at(Rate::BitsPerWeight(middle))?)? {
                low = middle;
            } else {
                high = middle;
            }
        }
        Ok(Rate::BitsPerWeight(low))
    }

    fn check(&self, fastest: f64) -> Result<()> {
        let TimeLimit { milliseconds, core, clock_hz, .. } = self.limit;
        ensure!(
            fastest <= milliseconds,
            "the limit is {milliseconds} ms, but the fastest step takes {fastest:.4} ms on {} at {} MHz; allow {:.3} ms or more",
            core.title(),
            clock_hz / 1e6,
            (1e3 * fastest).ceil() / 1e3
        );
        Ok(())
    }
}

/// Returns matrices to the activations before measurement until the time is kept, the largest first.
fn kept(mut quantized: QuantizedPolicy, limit: TimeLimit, activations: Activations) -> Result<QuantizedPolicy> {
    let outcomes = &quantized.outcomes;
    let mut wide: Vec<usize> = (0..outcomes.len()).filter(|&m| outcomes[m].x_max > activations.limit()).collect();
    wide.sort_by_key(|&m| outcomes[m].quantized.codes.len());
    loop {
        let time = predict(&quantized, limit)?;
        if time.milliseconds <= limit.milliseconds {
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

#[cfg(test)]
mod tests {
    use actq_kernels::cost::Core;

    use super::*;
    use crate::budget::Budget;
    use crate::data::Recordings;
    use crate::policy::Policy;
    use crate::testing::{branches, dataset, gru, layers, lstm, residual};

    #[test]
    fn cycles_beside_rows_hardly_depend_on_them() {
        for graph in [layers(&[18, 96, 64, 6]), lstm(), gru(24), residual(48, true), branches([64, 40])] {
            let recordings = Recordings { calib: Some(dataset(&graph, 4, 60)), heldout: None };
            let policy = Policy::of("small", graph);
            let quantizer = Quantizer::new(&policy, &recordings, Method::Distill, None, |_| {}).expect("statistics");
            let limit = TimeLimit { milliseconds: 1.0, core: Core::M4f, clock_hz: 168e6, image_bytes: None };
            let activations = Activations::Unmeasured;
            let options = Options { steps: Some(1), activations, ..Options::new(Method::Distill, Budget::Time(limit)) };
            let rest = |cycles: f64| {
                let rate = Rate::Within { bytes: None, cycles, core: limit.core };
                let network = quantizer.method.quantize(rate, &options, |_| {}).expect("a network");
                let counted = network.cycles.expect("they are limited");
                let image = quantizer.image_of(network, rate).expect("an image");
                let taken = predict(&image, limit).expect("a prediction").cycles as f64;
                taken - counted
            };
            let rests: Vec<f64> = (0..12).map(|i| rest(500.0 * f64::from(i * i))).collect();
            let (least, most) = rests.iter().fold((f64::MAX, 0.0f64), |(a, b), rest| (a.min(*rest), b.max(*rest)));
            assert!(most - least <= REST_MARGIN * 168e3, "{rests:?}");
        }
    }
}
