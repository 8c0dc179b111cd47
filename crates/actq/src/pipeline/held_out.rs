//! The error on frames that an image has not learned from, if there is no held-out recording.
//!
//! The image itself learns from all frames. For its error, parts of the recording are held out in turn: an image of the
//! same rate and the same choices learns from the rest, with half of the steps, and runs over the part. With fewer steps,
//! the images of parts are worse than the image.

use std::path::Path;

use super::quantizer::{QuantizedPolicy, Quantizer};
use crate::data::{Dataset, Part, Recordings};
use crate::error::Result;
use crate::measure::check::compared;
use crate::measure::eval::{ErrorReport, ErrorSums};
use crate::measure::size::bits_per_weight;
use crate::methods::{Method, Options, PreparedMethod, Progress};
use crate::policy::Policy;

/// Divisor of the steps for the image of a part.
const STEP_DIVISOR: usize = 2;

/// The error on held-out parts of the calibration recording.
#[derive(Clone, Debug)]
pub struct HeldOut {
    /// Errors over all parts, relative to the variance of the whole recording; bits and bytes of the image itself.
    pub report: ErrorReport,
    /// Parts that were held out in turn.
    pub parts: usize,
}

/// A method with statistics of a recording without a part, and the part with the f32 policy's actions.
#[derive(Debug)]
pub(super) struct Fold<'a> {
    method: PreparedMethod<'a>,
    held_out: Dataset,
}

/// Returns the minutes of learning that are left for the image itself: half of them if parts of the calibration recording
/// will be held out for its error, as the images without those parts take the other half.
pub fn minutes_of_image(policy: &Policy, recordings: &Recordings, options: &Options) -> Option<f64> {
    let minutes = options.minutes?;
    let calib = recordings.calib.as_ref().filter(|_| recordings.heldout.is_none());
    let has_parts = calib.is_some_and(|calib| !calib.parts(&policy.graph, options.method.least_frames()).is_empty());
    Some(if has_parts { minutes / 2.0 } else { minutes })
}

impl<'a> Quantizer<'a> {
    /// Measures the error of `found`, which this quantizer has made with `options`, on frames that were not learned from.
    /// `watch` receives the share done. `None` with a held-out recording, for a method that learns from no recording, and
    /// for a recording that is too short.
    ///
    /// # Errors
    ///
    /// If a part cannot be learned from or run.
    pub fn held_out_error(
        &self,
        found: &QuantizedPolicy,
        options: &Options,
        mut watch: impl FnMut(f64),
    ) -> Result<Option<HeldOut>> {
        let Some(calib) = &self.recordings.calib else { return Ok(None) };
        if self.recordings.heldout.is_some() || *self.method.method() == Method::Rtn {
            return Ok(None);
        }
        let folds = self.folds(calib, options)?;
        let Some(count) = Some(folds.len()).filter(|count| *count > 0) else { return Ok(None) };
        let share = |steps: usize| if steps > 0 { (steps / STEP_DIVISOR).max(1) } else { 0 };
        let steps = match options.minutes {
            Some(_) => options.steps.map(share),
            None => Some(share(self.method.most_steps(options))),
        };
        let options = Options {
            steps: if options.method == Method::Distill { steps } else { options.steps },
            minutes: options.minutes.map(|minutes| minutes / count as f64),
            choice: found.learning.as_ref().map(|learning| learning.choice),
            ..options.clone()
        };
        let mut all: Option<ErrorSums> = None;
        for (i, Fold { method, held_out }) in folds.iter().enumerate() {
            let progress = |state: Progress| watch((i as f64 + state.share()) / count as f64);
            let network = match method.quantize(found.rate, &options, progress) {
                // A part may need more for its balance than the whole.
                Err(error) if error.budget().is_some() => return Ok(None),
                network => network?,
            };
            let buffer = self.image_of(network, found.rate)?.buffer();
            let image = buffer.image(Path::new("the image of a part"))?;
            let sums = ErrorSums::of(image, held_out, 0..held_out.length.len())?;
            match &mut all {
                Some(all) => all.add(&sums)?,
                None => all = Some(sums),
            }
        }
        let whole = compared(&self.policy.graph, calib);
        let buffer = found.buffer();
        let image = buffer.image(Path::new("the image"))?;
        let report = all.map(|sums| {
            let sums = sums.relative_to(&whole);
            sums.report(bits_per_weight(&image), image.bytes(), &calib.path)
        });
        Ok(report.transpose()?.map(|report| HeldOut { report, parts: count }))
    }

    /// Returns the statistics without each part, which are collected once.
    fn folds(&self, calib: &Dataset, options: &Options) -> Result<&[Fold<'a>]> {
        if self.folds.get().is_none() {
            let policy: &'a Policy = self.policy;
            let graph = &policy.graph;
            let fold = |Part { learned, held_out }| -> Result<Fold<'a>> {
                let method = self.method.method().clone();
                let method = PreparedMethod::before(graph, method, Some(&learned), options.minutes, |_| {})?;
                Ok(Fold { method, held_out: compared(graph, &held_out) })
            };
            let parts = calib.parts(graph, self.method.method().least_frames());
            let folds = parts.into_iter().map(fold).collect::<Result<_>>()?;
            // No other thread has set them: this one would have the same.
            drop(self.folds.set(folds));
        }
        Ok(self.folds.get().map_or(&[], Vec::as_slice))
    }
}

#[cfg(test)]
mod tests {
    use ndarray::Array3;

    use super::*;
    use crate::budget::Budget;
    use crate::graph::Graph;
    use crate::measure::eval::evaluate;
    use crate::random::Random;
    use crate::testing::{layers, lstm};

    /// Makes a smooth random path of one episode, as sensors give, with the network's actions.
    fn walk(graph: &Graph, frames: usize, seed: u64) -> Dataset {
        let mut random = Random::new(seed);
        let mut at: Vec<f32> = (0..graph.obs_len).map(|_| random.normal()).collect();
        let obs = Array3::from_shape_fn((1, frames, graph.obs_len), |(_, _, i)| {
            at[i] = 0.95 * at[i] + 0.3 * random.normal();
            at[i]
        });
        let mut dataset = Dataset { path: "walk.npz".into(), obs, action: None, length: vec![frames], state: None };
        dataset.fill_actions(graph);
        dataset
    }

    /// Returns the errors on the frames learned from, on held-out parts, and on fresh frames.
    fn errors(graph: &Graph, frames: usize, options: &Options) -> (f64, Option<f64>, f64) {
        let policy = Policy::of("random", graph.clone());
        let recordings = Recordings { calib: Some(walk(graph, frames, 5)), heldout: None };
        let quantizer = Quantizer::new(&policy, &recordings, options.method.clone(), None, |_| {}).expect("statistics");
        let found = quantizer.quantize(options, ()).expect("an image");
        let held_out = quantizer.held_out_error(&found, options, |_| {}).expect("measured");
        let buffer = found.buffer();
        let image = buffer.image(Path::new("memory")).expect("an image");
        let of = |dataset: &Dataset| evaluate(image, dataset).expect("errors").nmse;
        let learned = of(recordings.calib.as_ref().expect("a recording"));
        (learned, held_out.map(|held_out| held_out.report.nmse), of(&walk(graph, 20_000, 6)))
    }

    #[test]
    fn printed_errors_are_those_of_fresh_frames() {
        let mut gaps = 0;
        for (sizes, bits, steps) in [(&[6, 32, 3][..], 2.5, 2000), (&[10, 24, 16, 4], 4.0, 2000)] {
            let graph = layers(sizes);
            for frames in [300, 1000, 4000] {
                for method in [Method::Gptq, Method::Distill] {
                    let steps = (method == Method::Distill).then_some(steps);
                    let options = Options { steps, ..Options::new(method, Budget::BitsPerWeight(bits + 4.0)) };
                    let (learned, held_out, fresh) = errors(&graph, frames, &options);
                    let held_out = held_out.expect("parts are held out");
                    let ratio = held_out / fresh;
                    let which = format!("{sizes:?}, {frames} frames, {}: {learned} {held_out} {fresh}", options.method);
                    assert!((1.0 / 1.5..1.5).contains(&ratio), "{which}");
                    gaps += usize::from(fresh > 1.5 * learned);
                }
            }
        }
        assert!(gaps > 0, "no image fits its recording better than fresh frames, so the test shows nothing");
    }

    #[test]
    fn short_recordings_and_rounding_hold_nothing_out() {
        let graph = lstm();
        let with = |method: Method, frames: usize| {
            let steps = (method == Method::Distill).then_some(20);
            errors(&graph, frames, &Options { steps, ..Options::new(method, Budget::BitsPerWeight(20.0)) }).1
        };
        assert_eq!(with(Method::Rtn, 300), None);
        assert_eq!(with(Method::Distill, 220), None);
        assert!(with(Method::Distill, 230).is_some_and(|error| error > 0.0));
        assert!(with(Method::Gptq, 30).is_some_and(|error| error > 0.0));
    }

    #[test]
    fn half_of_the_minutes_measure_if_parts_can_be_held_out() {
        let policy = Policy::of("random", lstm());
        let options = Options { minutes: Some(4.0), ..Options::new(Method::Distill, Budget::BitsPerWeight(8.0)) };
        let minutes = |frames: usize, heldout: Option<usize>| {
            let walk = |frames| walk(&policy.graph, frames, 5);
            let recordings = Recordings { calib: Some(walk(frames)), heldout: heldout.map(walk) };
            minutes_of_image(&policy, &recordings, &options)
        };
        assert_eq!([minutes(230, None), minutes(220, None), minutes(230, Some(9))], [Some(2.0), Some(4.0), Some(4.0)]);
    }

    #[test]
    fn measuring_on_parts_changes_no_image() {
        let graph = layers(&[6, 16, 3]);
        let policy = Policy::of("random", graph.clone());
        let recordings = Recordings { calib: Some(walk(&graph, 300, 5)), heldout: None };
        let options = Options { steps: Some(40), ..Options::new(Method::Distill, Budget::BitsPerWeight(8.0)) };
        let quantizer = Quantizer::new(&policy, &recordings, Method::Distill, None, |_| {}).expect("statistics");
        let before = quantizer.quantize(&options, ()).expect("an image");
        let first = quantizer.held_out_error(&before, &options, |_| {}).expect("measured").expect("parts");
        let after = quantizer.quantize(&options, ()).expect("an image");
        assert_eq!(before.image, after.image);
        let again = quantizer.held_out_error(&after, &options, |_| {}).expect("measured").expect("parts");
        assert_eq!((first.report.nmse, first.parts), (again.report.nmse, 5));
    }
}
