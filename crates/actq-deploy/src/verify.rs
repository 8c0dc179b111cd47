//! Comparison of a description's image with the description itself, before the quantizer changes any weight.

use std::path::Path;

use actq::budget::Budget;
use actq::data::Recordings;
use actq::emit::raw_values;
use actq::error::{Cause, Context as _, Error, Result, bail};
use actq::measure::unrounded::Unrounded;
use actq::methods::{Method, Options};
use actq::pipeline::{QuantizedPolicy, quantize};
use actq::random::Random;
use actq::runtime::ImageBuffer;
use actq_kernels::{StepError, Width};

use crate::compile::Deployment;
use crate::plan::Plan;
use crate::reference::{Difference, TOLERANCE};
use crate::run::{Noise, Runner};

/// Raw inputs of a tick.
type Raw = Vec<Vec<f64>>;

/// Ticks of drawn raw values.
const TICKS: usize = 48;
/// Most ticks that are compared: errors that feed themselves grow with every tick.
const MAX_TICKS: usize = 200;
/// Errors of values and outputs in f32, several times the rounding of an operation.
pub const ROUNDING: [f64; 2] = [1e-6; 2];
/// Runs with errors, if a difference may be what small errors grow to.
const NOISY_RUNS: u64 = 32;
/// Largest difference, as a multiple of that between runs with errors.
const GROWTH: f64 = 4.0;

/// `true` for a quaternion that is not an orientation.
fn is_no_action(error: &Error) -> bool {
    let Cause::Other(cause) = error.cause() else { return false };
    cause.downcast_ref() == Some(&StepError::Orientation)
}

/// Returns the targets of an image with all operations in f32, and the weights as they were before they were quantized.
fn in_f32(rounded: &QuantizedPolicy, bytes: &[u8], raw: &[Raw]) -> Result<Vec<Vec<f32>>> {
    let buffer = ImageBuffer::new(bytes);
    let image = buffer.image(Path::new("image"))?;
    let mut unrounded = Unrounded::with_weights(image, &rounded.policy.graph)?;
    let limited = |(i, x): (usize, &f32)| image.limits(i).map_or(*x, |[low, high]| x.max(low).min(high));
    let mut tick = |raw: &Raw| -> Result<Vec<f32>> {
        let raw: Vec<f32> = raw.iter().flatten().map(|x| *x as f32).collect();
        match unrounded.infer(&raw) {
            Ok(targets) => Ok(targets.iter().enumerate().map(limited).collect()),
            Err(error) if is_no_action(&error) => Ok(vec![f32::NAN; image.act_len()]),
            Err(error) => Err(error),
        }
    };
    raw.iter().map(&mut tick).collect()
}

impl Runner {
    /// Returns the first of `found` targets of an image that is not the description's: beyond rounding, and beyond
    /// what random errors of values and outputs grow to.
    pub fn difference(&mut self, raw: &[Raw], found: &[Vec<f32>], errors: [f64; 2]) -> Option<Difference> {
        let (expected, mut allowed) = self.over(raw, None);
        let first = |allowed: &[Vec<f64>]| {
            let differs = |t: usize, i: usize| {
                let (found, expected) = (f64::from(found[t][i]), expected[t][i]);
                // Beyond f32, an image gives no action.
                let is_none = !found.is_finite() && !(expected as f32).is_finite();
                let is_near = (found - expected).abs() <= allowed[t][i];
                !is_none && !is_near
            };
            let all = found.iter().enumerate().flat_map(|(t, found)| (0..found.len()).map(move |i| (t, i)));
            all.into_iter().find(|(t, i)| differs(*t, *i))
        };
        for seed in 0..NOISY_RUNS {
            first(&allowed)?;
            let noise = Noise { random: Random::new(seed), of_values: errors[0], of_outputs: errors[1] };
            let (noisy, _) = self.over(raw, Some(noise));
            for (allowed, (a, b)) in
                allowed.iter_mut().flatten().zip(noisy.iter().flatten().zip(expected.iter().flatten()))
            {
                let grown = GROWTH * (a - b).abs();
                *allowed = if grown.is_nan() { f64::INFINITY } else { allowed.max(grown) };
            }
        }
        let (tick, i) = first(&allowed)?;
        let labels = self.plan().targets.iter().flat_map(|target| {
            (0..self.plan().values[target.value].labels.len())
                .map(|i| format!("{}[{i}]", self.plan().names[target.value]))
        });
        let what = labels.collect::<Vec<_>>().swap_remove(i);
        Some(Difference { tick, kind: "target", what, got: found[tick][i].into(), expected: expected[tick][i] })
    }

    /// Returns the targets of each tick, one after the other, and the rounding that they may have.
    fn over(&mut self, raw: &[Raw], noise: Option<Noise>) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
        self.reset_with(noise);
        let mut largest = vec![0f64; self.plan().targets.len()];
        let mut tick = |raw: &Raw| {
            let (mut all, mut rounding) = (Vec::new(), Vec::new());
            // No action: a quaternion that is not an orientation.
            let Ok(tick) = self.step(raw) else {
                let len = self.plan().targets.iter().map(|target| self.plan().values[target.value].labels.len()).sum();
                return (vec![f64::NAN; len], vec![0.0; len]);
            };
            for ((_, target), largest) in tick.targets.into_iter().zip(&mut largest) {
                *largest = target.iter().fold(*largest, |most, x| most.max(x.abs()));
                rounding.extend(vec![TOLERANCE * largest.max(1e-3); target.len()]);
                all.extend(target);
            }
            (all, rounding)
        };
        let all = raw.iter().map(&mut tick).unzip();
        self.reset_with(None);
        all
    }
}

impl Deployment {
    /// Returns an image with the weights in 4 bits, by rounding.
    ///
    /// # Errors
    ///
    /// If the description does not fit an image.
    pub fn four_bits(&self) -> Result<Vec<u8>> {
        self.rounded()?.whole_image()
    }

    fn rounded(&self) -> Result<QuantizedPolicy> {
        let options = Options::new(Method::Rtn, Budget::Width(Width::W4));
        quantize(&self.policy, &Recordings::default(), &options, ())
    }

    /// Returns the targets of an image in 4 bits with all operations in f32 and the weights as they were before they
    /// were quantized.
    ///
    /// # Errors
    ///
    /// If the description does not fit an image.
    pub fn in_f32(&self, raw: &[Raw]) -> Result<Vec<Vec<f32>>> {
        let rounded = self.rounded()?;
        in_f32(&rounded, &rounded.whole_image()?, raw)
    }

    /// Draws raw inputs of some ticks: numbers from -1 to 1 in the inputs' ranges, quaternions of length 1, zeros.
    pub fn draws(&self, plan: &Plan, random: &mut Random, ticks: usize) -> Vec<Raw> {
        let around = self.policy.around.iter();
        let mut draws: Vec<Raw> =
            around.flat_map(|around| raw_values(around, random, ticks, true)).map(|raw| plan.split(&raw)).collect();
        // A quaternion that no target depends on is in the description only.
        let free = plan.ranges.iter().map(Option::is_none);
        for (values, _) in draws.iter_mut().flat_map(|raw| raw.iter_mut().zip(free.clone())).filter(|(_, free)| *free) {
            let norm = values.iter().map(|x| x * x).sum::<f64>().sqrt();
            if values.len() == 4 && norm <= 2.0 {
                values.iter_mut().for_each(|x| *x = if norm > 0.0 { f64::from((*x / norm) as f32) } else { 0.5 });
            }
        }
        draws
    }

    /// Compares an image of this description in f32 with the description itself.
    ///
    /// # Errors
    ///
    /// If they differ; the error names the tick and the target.
    pub fn verify(&self, runner: &mut Runner, raw: &[Raw]) -> Result<()> {
        // A description that fits no image in 4 bits may fit one in other bits; quantization reports why.
        let Ok(rounded) = self.rounded() else { return Ok(()) };
        let Ok(image) = rounded.whole_image() else { return Ok(()) };
        let raw = &raw[..raw.len().min(MAX_TICKS)];
        let mut found = in_f32(&rounded, &image, raw).context("compare an image with the description")?;
        // An image gives no action that is not finite, and starts anew after it.
        let end = found.iter().position(|target| target.iter().any(|x| !x.is_finite())).map_or(found.len(), |t| t + 1);
        found.truncate(end);
        if let Some(Difference { tick, what, got, expected, .. }) =
            runner.difference(&raw[..found.len()], &found, ROUNDING)
        {
            bail!(
                "tick {tick}: {what} is {got:.6} in an image, and {expected:.6} by the description; \
                 internal error; please report it"
            );
        }
        Ok(())
    }

    /// Compares on drawn raw values.
    pub(crate) fn verify_on_draws(&self, plan: Plan) -> Result<()> {
        let draws = [0, 1].map(|seed| self.draws(&plan, &mut Random::new(seed), TICKS));
        let mut runner = Runner::new(plan);
        // A draw may be at a jump of an operation, where rounding decides; two are not.
        self.verify(&mut runner, &draws[0]).or_else(|_| self.verify(&mut runner, &draws[1]))
    }
}
