//! A prepared policy and method, and the images made from them.

use std::sync::OnceLock;

use super::held_out::{Fold, HeldOut};
use super::tries::Search;
use crate::budget::Rate;
use crate::data::Recordings;
use crate::emit;
use crate::error::{Error, Result};
use crate::measure::time::StepTime;
use crate::methods::{Learning, Method, Options, Outcome, PreparedMethod, Progress, QuantizedNetwork};
use crate::policy::Policy;
use crate::runtime::ImageBuffer;

/// A policy with a prepared method, for images of any number of budgets.
#[derive(Debug)]
pub struct Quantizer<'a> {
    pub(super) policy: &'a Policy,
    pub(super) recordings: &'a Recordings,
    pub(super) method: PreparedMethod<'a>,
    /// Statistics without held-out parts of the calibration recording, as soon as they are needed.
    pub(super) folds: OnceLock<Vec<Fold<'a>>>,
}

/// A quantized policy.
#[derive(Debug)]
pub struct QuantizedPolicy {
    /// The quantized policy: its graph may have lost elements, and its biases may have changed.
    pub policy: Policy,
    /// Result for each matrix.
    pub outcomes: Vec<Outcome>,
    /// The image of the network; [`Self::whole_image`] has what is around it, too.
    pub image: Vec<u8>,
    /// Rate that the weights were quantized to.
    pub rate: Rate,
    /// Learning, if the method learns.
    pub learning: Option<Learning>,
    /// Search, if the budget is an error.
    pub search: Option<Search>,
    /// Error on held-out parts of the calibration recording, if the search has measured it.
    pub held_out: Option<HeldOut>,
    /// Predicted step, if the budget is a time.
    pub time: Option<StepTime>,
}

impl<'a> Quantizer<'a> {
    /// Collects the method's statistics from the calibration recording, as [`PreparedMethod::before`] does, with its
    /// errors. `minutes` limits learning, as [`Options::minutes`].
    pub fn new(
        policy: &'a Policy,
        recordings: &'a Recordings,
        method: Method,
        minutes: Option<f64>,
        progress: impl FnMut(f64),
    ) -> Result<Self> {
        let mut method = PreparedMethod::before(&policy.graph, method, recordings.calib.as_ref(), minutes, progress)?;
        recordings.heldout.iter().for_each(|held_out| method.watch(held_out));
        Ok(Self { policy, recordings, method, folds: OnceLock::new() })
    }

    /// Returns the method with its statistics.
    pub fn method(&self) -> &PreparedMethod<'a> {
        &self.method
    }

    /// Makes an image at a rate; `options.budget` is ignored.
    pub(super) fn at(
        &self,
        rate: Rate,
        options: &Options,
        progress: &mut dyn FnMut(Progress),
    ) -> Result<QuantizedPolicy> {
        let network = self.method.quantize(rate, options, progress);
        self.image_of(network.map_err(|error| self.cause(error))?, rate)
    }

    /// Returns why a method fails: a f32 policy that gives no finite actions, or its own error.
    fn cause(&self, error: Error) -> Error {
        let calib = self.recordings.calib.as_ref().filter(|_| error.budget().is_none());
        let infinite = calib.and_then(|calib| calib.require_finite(&self.policy.graph).err());
        infinite.unwrap_or(error)
    }

    /// Makes the image of a network that was quantized to a rate.
    pub(super) fn image_of(&self, network: QuantizedNetwork, rate: Rate) -> Result<QuantizedPolicy> {
        let QuantizedNetwork { graph, outcomes, learning, .. } = network;
        let policy = Policy { graph, ..self.policy.clone() };
        let image = emit::image(&policy, &outcomes)?;
        Ok(QuantizedPolicy { policy, outcomes, image, rate, learning, search: None, held_out: None, time: None })
    }
}

impl QuantizedPolicy {
    /// Returns the steps of distillation; 0 for methods that do not learn.
    pub fn steps(&self) -> usize {
        self.learning.as_ref().map_or(0, |learning| learning.steps)
    }

    /// Returns the image with what is around the network: what a robot runs. Without that, it is [`Self::image`].
    ///
    /// # Errors
    ///
    /// As [`emit::image_around`].
    pub fn whole_image(&self) -> Result<Vec<u8>> {
        match &self.policy.around {
            Some(around) => emit::image_around(&self.policy, &self.outcomes, around),
            None => Ok(self.image.clone()),
        }
    }

    /// Returns the image in a buffer for the executor.
    pub fn buffer(&self) -> ImageBuffer {
        ImageBuffer::new(&self.image)
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::budget::Budget;
    use crate::measure::eval::evaluate;
    use crate::testing::{dataset, transformer};

    /// Returns the NMSE of an image of this many bits, on other frames than those that it learned from.
    fn error(policy: &Policy, method: Method, bits: u32) -> f64 {
        let graph = &policy.graph;
        let recordings = Recordings { calib: Some(dataset(graph, 20, 40)), heldout: None };
        let steps = (method == Method::Distill).then_some(300);
        // Scales, padding and biases of rows of 16 values are some bits beside.
        let options = Options { steps, ..Options::new(method, Budget::BitsPerWeight(f64::from(bits) + 2.0)) };
        let quantizer = Quantizer::new(policy, &recordings, options.method.clone(), None, |_| {}).expect("statistics");
        let buffer = quantizer.quantize(&options, ()).expect("an image").buffer();
        let fresh = dataset(graph, 7, 33);
        evaluate(buffer.image(Path::new("memory")).expect("an image"), &fresh).expect("errors").nmse
    }

    #[test]
    fn transformers_are_quantized_by_every_method() {
        for context in [0, 3] {
            let policy = Policy::of("transformer", transformer(context));
            let errors = |method: Method, bits: &[u32]| -> Vec<f64> {
                let errors: Vec<f64> = bits.iter().map(|bits| error(&policy, method.clone(), *bits)).collect();
                assert!(errors[0] < 5e-3 || bits[0] < 8, "context {context}, {method}: {errors:?}");
                assert!(errors.is_sorted(), "context {context}, {method}: {errors:?}");
                errors
            };
            let (rtn, gptq) = (errors(Method::Rtn, &[8, 4, 3, 2]), errors(Method::Gptq, &[8, 4, 3, 2]));
            let distill = errors(Method::Distill, &[2]);
            assert!(gptq[3] < rtn[3] && distill[0] < 0.5 * rtn[3], "context {context}: {rtn:?} {gptq:?} {distill:?}");
        }
    }
}
