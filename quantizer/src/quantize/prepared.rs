//! A method with all that it needs to know about the recorded observations.

use actq_kernels::Width;
use anyhow::{Context as _, Result, ensure};

use super::actquant::Statistics;
use super::moments::{Moments, collect};
use super::{Budget, Method, Options, Outcome, actquant, best, quantize};
use crate::dataset::recording::Recording;
use crate::dataset::{Dataset, Sizes};
use crate::policy::Policy;
use crate::writer;

/// Frames that every method with a recording needs at least; best needs more.
const LEAST_FRAMES: usize = 16;

/// A method made ready once, to quantize a policy for any number of budgets.
#[derive(Debug)]
pub struct Prepared<'a> {
    policy: &'a Policy,
    method: Method,
    /// Of every matrix's input; empty where the method needs none.
    moments: Vec<Moments>,
    /// Of ActQuant; otherwise `None`.
    pub actquant: Option<Statistics>,
    /// What best learns from; otherwise `None`.
    best: Option<best::Statistics<'a>>,
}

impl<'a> Prepared<'a> {
    /// Reads the calibration recording of the policy's folder if the method needs it, and collects. `progress` gets the share
    /// done.
    pub fn new(policy: &'a Policy, method: Method, progress: impl FnMut(f64)) -> Result<Self> {
        let calib = match method {
            Method::Rtn => None,
            _ => Recording::Calib.load(Some(&policy.dir), None, Sizes::of(policy))?,
        };
        Self::with_recording(policy, method, calib.as_ref(), progress)
    }

    /// Collects what the method needs from `calib`, a recording that fits the policy. `progress` gets the share done.
    pub fn with_recording(
        policy: &'a Policy,
        method: Method,
        calib: Option<&Dataset>,
        mut progress: impl FnMut(f64),
    ) -> Result<Self> {
        let graph = &policy.graph;
        let calib = || -> Result<&Dataset> {
            let calib = calib.with_context(|| Recording::Calib.missing(&method.to_string()))?;
            calib.require_frames(LEAST_FRAMES, "statistics of fewer are those of a few chance observations")?;
            Ok(calib)
        };
        let mut prepared = Self { policy, method, moments: Vec::new(), actquant: None, best: None };
        match method {
            Method::Rtn => {}
            Method::Gptq | Method::Best => {
                let dataset = calib()?;
                let all = dataset.frames().max(1) as f64;
                prepared.moments = collect(graph, dataset, |frames| progress(frames as f64 / all));
                if method == Method::Best {
                    let moments = std::mem::take(&mut prepared.moments);
                    prepared.best = Some(best::Statistics::collect(graph, dataset, moments)?);
                }
            }
            Method::ActQuant => prepared.actquant = Some(Statistics::collect(graph, calib()?, progress)?),
        }
        Ok(prepared)
    }

    /// Quantizes the policy: the policy as it became (its graph may have lost elements, its biases may have learned), and its
    /// matrices. `options.method` is the one that was prepared. `progress` gets the share done.
    pub fn quantize(&self, options: &Options, progress: impl FnMut(f64)) -> Result<(Policy, Vec<Outcome>)> {
        let graph = &self.policy.graph;
        ensure!(options.method == self.method, "prepared for {}, not for {}", self.method, options.method);
        ensure!(
            options.forced.is_empty() || self.method == Method::Best,
            "widths of single matrices go with method best, not with {}",
            self.method
        );
        let options = &match options.budget {
            Budget::ImageBytes(bytes) => Options { budget: self.within_image(bytes)?, ..options.clone() },
            _ => options.clone(),
        };
        if let Some(statistics) = &self.best {
            let (graph, outcomes) = best::quantize(graph, statistics, options, progress)?;
            return Ok((Policy { graph, ..self.policy.clone() }, outcomes));
        }
        let outcomes = match &self.actquant {
            Some(statistics) => actquant::quantize(graph, statistics, options)?,
            None => quantize(graph, &self.moments, options)?,
        };
        Ok((self.policy.clone(), outcomes))
    }

    /// Steps of distillation with these options; 0 for methods that do not learn.
    pub fn steps(&self, options: &Options) -> usize {
        self.best.as_ref().map_or(0, |statistics| options.steps.unwrap_or(statistics.default_steps()))
    }

    /// The budget for the weights that leaves room for everything else in an image of `bytes` bytes.
    fn within_image(&self, bytes: usize) -> Result<Budget> {
        let policy = self.policy;
        let plain = quantize(&policy.graph, &[], &Options::new(Method::Rtn, Budget::Width(Width::W2)))?;
        let weights: usize = plain.iter().map(|m| m.bytes()).sum();
        let rest = writer::image(policy, &plain)?.len() - weights;
        ensure!(bytes > rest, "{bytes} bytes are allowed, but all but the weights already takes {rest}");
        Ok(Budget::BitsPerWeight(8.0 * (bytes - rest) as f64 / policy.graph.weights().max(1) as f64))
    }
}
