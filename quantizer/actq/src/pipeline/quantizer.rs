//! A policy and a method made ready, and the images that they give.

use super::tries::Search;
use crate::budget::Rate;
use crate::data::Recordings;
use crate::emit;
use crate::error::Result;
use crate::measure::time::StepTime;
use crate::methods::{Learning, Method, Options, Outcome, PreparedMethod, Progress, QuantizedNetwork};
use crate::policy::Policy;
use crate::runtime::ImageBuffer;

/// A policy and a method made ready once, to make images for any number of budgets.
#[derive(Debug)]
pub struct Quantizer<'a> {
    pub(super) policy: &'a Policy,
    pub(super) recordings: &'a Recordings,
    pub(super) method: PreparedMethod<'a>,
}

/// What became of a policy.
#[derive(Debug)]
pub struct QuantizedPolicy {
    /// The policy as it became: its graph may have lost elements, its biases may have learned.
    pub policy: Policy,
    /// Its matrices.
    pub outcomes: Vec<Outcome>,
    /// The image.
    pub image: Vec<u8>,
    /// What the weights were quantized to.
    pub rate: Rate,
    /// What was learned, where something was.
    pub learning: Option<Learning>,
    /// What was tried, where the budget is an error.
    pub search: Option<Search>,
    /// The predicted step, where the budget is a time.
    pub time: Option<StepTime>,
}

impl<'a> Quantizer<'a> {
    /// Collects what the method needs from the calibration recording, as [`PreparedMethod::before`] does, with its
    /// errors. `minutes` is what learning may take at most, [`Options::minutes`].
    pub fn new(
        policy: &'a Policy,
        recordings: &'a Recordings,
        method: Method,
        minutes: Option<f64>,
        progress: impl FnMut(f64),
    ) -> Result<Self> {
        let method = PreparedMethod::before(&policy.graph, method, recordings.calib.as_ref(), minutes, progress)?;
        Ok(Self { policy, recordings, method })
    }

    /// The method with its statistics.
    pub fn method(&self) -> &PreparedMethod<'a> {
        &self.method
    }

    /// Makes an image at a rate; `options.budget` does not count.
    pub(super) fn at(
        &self,
        rate: Rate,
        options: &Options,
        progress: &mut dyn FnMut(Progress),
    ) -> Result<QuantizedPolicy> {
        let QuantizedNetwork { graph, outcomes, learning } = self.method.quantize(rate, options, progress)?;
        let policy = Policy { graph, ..self.policy.clone() };
        let image = emit::image(&policy, &outcomes)?;
        Ok(QuantizedPolicy { policy, outcomes, image, rate, learning, search: None, time: None })
    }
}

impl QuantizedPolicy {
    /// Steps of distillation; 0 for methods that do not learn.
    pub fn steps(&self) -> usize {
        self.learning.as_ref().map_or(0, |learning| learning.steps)
    }

    /// The image where the executor can run it.
    pub fn buffer(&self) -> ImageBuffer {
        ImageBuffer::new(&self.image)
    }
}
